// Answers to queries as plain values, detached from the map: layers are names, and objects and
// grids are in the caller's frame. Clients receive answers in this form.
#ifndef HYPERMAP_MAP_QUERY_ANSWERS_H_
#define HYPERMAP_MAP_QUERY_ANSWERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "map/geometry/point.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"

namespace hypermap::answers {

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
  uint64_t incarnation = 0;          // of the map to which the revision belongs
};

// A part of one layer's answer to a query for an area or a value. The parts of a layer follow each
// other. Each layer has at least one part, which may be empty.
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
  uint64_t incarnation = 0;  // of the map to which the revision belongs
};

}  // namespace hypermap::answers

#endif  // HYPERMAP_MAP_QUERY_ANSWERS_H_
