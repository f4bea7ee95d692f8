// What a Hypermap server answers, in the words of the domain. Plain values.
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
#include "map/watch/told_change.h"

namespace hypermap::client {

// A map apart from its content.
struct MapEntry {
  std::string name;
  std::string frame_id;
  Revision revision = 0;
  absl::Time create_time;
  int layer_count = 0;
  // Not empty when the server can't open the map: why. Only the name is set then.
  std::string problem;
};

// A layer apart from its content.
struct LayerEntry {
  LayerSpec spec;
  // Objects of a semantic layer, or cells in the extent of a grid.
  int64_t size = 0;
  // The box of all cells ever written; absent while there are none, and for semantic layers.
  std::optional<CellBox> extent;
  // The newest revision that changed it or its content.
  Revision version = 0;
  // What its content is like: enough to draw and print a layer of any kind.
  LayerProperties properties;
};

struct LayerList {
  std::string map;
  Revision revision = 0;
  std::vector<LayerEntry> layers;  // by name
};

struct TransformList {
  std::string map;
  Revision revision = 0;
  std::string frame_id;                    // the map's own
  std::vector<FrameTransform> transforms;  // by child
};

// A file by its base name, with all of its bytes.
struct NamedFile {
  std::string name;
  std::string data;
};

struct ImportAnswer {
  std::string map;
  Revision revision = 0;
  std::vector<std::string> layers;  // made or written
  // How the server understood what was not as the format has it.
  std::vector<std::string> repairs;
};

struct ExportAnswer {
  std::string map;
  Revision revision = 0;
  std::vector<NamedFile> files;
  std::vector<std::string> omissions;  // what the format can't carry
};

struct EditAnswer {
  std::string map;
  Revision revision = 0;
  // One for each edit: the id of the object that was put, else 0.
  std::vector<ObjectId> object_ids;
};

// What one layer has at a point.
struct LayerContent {
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;
  std::optional<double> value;          // a grid's, when status is kValue
  std::vector<SemanticObject> objects;  // a semantic layer's, in the frame of the answer
};

struct PointAnswer {
  std::string map;
  Revision revision = 0;
  std::string frame_id;
  Point point;
  std::vector<LayerContent> layers;  // in the order asked; all layers by name
};

// A part of one layer's answer to an area or value question. The parts of a layer follow each
// other; a layer that can answer gives at least one, which may be empty.
struct LayerPart {
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  AnswerStatus status = AnswerStatus::kValue;  // kValue, or why the layer can't answer
  std::vector<SemanticObject> objects;         // by id; in the frame of the question
  std::optional<GridGeometry> grid;            // a grid's, in the frame of the question
  std::vector<CellRun> runs;                   // by row and column
};

// One place that has the value asked for.
struct NearestMatch {
  std::string layer;
  LayerKind kind = LayerKind::kSemantic;
  double distance_m = 0.0;  // to the object's nearest point, or to the cell's centre
  std::optional<SemanticObject> object;
  std::optional<GridGeometry> grid;  // of the cell, in the frame of the question
  std::optional<CellRun> cell;
};

struct LayerRefusal {
  std::string layer;
  AnswerStatus status = AnswerStatus::kUnsupportedValue;
};

struct NearestAnswer {
  std::string map;
  Revision revision = 0;
  std::string frame_id;
  std::vector<NearestMatch> matches;   // nearest first
  std::vector<LayerRefusal> refusals;  // layers that can't answer
};

// What a map is told to have changed in. Objects and cells in the frame that was asked for.
struct MapChange {
  ChangeKind kind = ChangeKind::kPut;
  std::string layer;
  ObjectId object_id = 0;                       // of objects
  std::optional<SemanticObject> object;         // kPut, kEnter: as it is now
  std::optional<SemanticObject> object_before;  // of a difference: as it was
  // kCells: those that are not as they were, by row and column.
  std::optional<GridGeometry> grid;
  std::vector<CellRun> cells;
  std::vector<CellRun> cells_before;        // of a difference: the same cells as they were
  std::optional<LayerEntry> layer_now;      // kLayerCreated, kLayerChanged
  std::optional<FrameTransform> transform;  // kTransform
};

struct RevisionEntry {
  Revision revision = 0;
  absl::Time time;
  std::string author;
  int64_t num_changes = 0;
};

struct RevisionList {
  std::string map;
  Revision newest = 0;
  Revision oldest = 0;  // that can be asked for
  std::vector<RevisionEntry> revisions;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_ANSWERS_H_
