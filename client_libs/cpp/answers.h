// Answers of a Hypermap server as plain values of the domain.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/frames/frame_tree.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer.h"
#include "map/layers/layer_properties.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"
#include "map/watch/map_change.h"

namespace hypermap::client {

// A map without its content.
struct MapEntry {
  std::string name;
  std::string frame_id;
  Revision revision = 0;
  absl::Time create_time;
  int layer_count = 0;
  // Reason why the server can't open the map; only the name is set besides. Empty if it is open.
  std::string problem;
};

// A layer without its content.
struct LayerEntry {
  LayerSpec spec;
  // Number of objects of a semantic layer, or of cells in the extent of a grid.
  int64_t size = 0;
  // For grids: the box around all cells ever written. Absent if there are none.
  std::optional<CellBox> extent;
  // The newest revision that changed the layer or its content.
  Revision version = 0;
  // Describes the content, well enough to draw and print a layer of any kind.
  LayerProperties properties;
};

struct LayerList {
  std::string map;
  Revision revision = 0;
  std::vector<LayerEntry> layers;  // sorted by name
};

struct TransformList {
  std::string map;
  Revision revision = 0;
  std::string frame_id;                    // the map's own
  std::vector<FrameTransform> transforms;  // sorted by child
};

// The base name and the bytes of a file.
struct NamedFile {
  std::string name;
  std::string data;
};

struct ImportAnswer {
  std::string map;
  Revision revision = 0;
  std::vector<std::string> layers;  // created or written
  // Deviations from the file format that were repaired, and how each was read.
  std::vector<std::string> repairs;
};

struct ExportAnswer {
  std::string map;
  Revision revision = 0;
  std::vector<NamedFile> files;
  std::vector<std::string> omissions;  // parts of the map that the format can't represent
};

struct EditAnswer {
  std::string map;
  Revision revision = 0;
  // One for each edit: the id of the object for PutObject, otherwise 0.
  std::vector<ObjectId> object_ids;
};

// The content of one layer at a point.
struct LayerContent {
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;
  std::optional<double> value;          // for grids, if status is kValue
  std::vector<SemanticObject> objects;  // for semantic layers, in the frame of the answer
};

struct PointAnswer {
  std::string map;
  Revision revision = 0;
  std::string frame_id;
  Point point;
  std::vector<LayerContent> layers;  // in the order of the scope; without one, by name
};

// A part of one layer's answer to QueryArea or QueryValue. The parts of a layer follow each other.
// Each layer has at least one part, which may be empty.
struct LayerPart {
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;  // kValue, or the reason why the layer can't answer
  std::vector<SemanticObject> objects;         // sorted by id, in the frame of the query
  std::optional<GridGeometry> grid;            // for grids, in the frame of the query
  std::vector<CellRun> runs;                   // sorted by row and column
};

// A place that has the value of a nearest query.
struct NearestMatch {
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  double distance_m = 0.0;  // to the object's nearest point, or to the cell's centre
  std::optional<SemanticObject> object;
  std::optional<GridGeometry> grid;  // of the cell, in the frame of the query
  std::optional<CellRun> cell;
};

// A layer that can't answer, and why.
struct LayerRefusal {
  std::string layer;
  AnswerStatus status = AnswerStatus::kUnsupportedValue;
};

struct NearestAnswer {
  std::string map;
  Revision revision = 0;
  std::string frame_id;
  std::vector<NearestMatch> matches;  // nearest first
  std::vector<LayerRefusal> refusals;
};

// Objects and cells are in the requested frame; caller_from_layer is the identity.
using hypermap::MapChange;

struct RevisionEntry {
  Revision revision = 0;
  absl::Time time;
  std::string author;
  int64_t num_changes = 0;
};

struct RevisionList {
  std::string map;
  Revision newest = 0;
  Revision oldest = 0;  // the oldest that can be queried
  std::vector<RevisionEntry> revisions;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_
