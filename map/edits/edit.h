// What can be done to a map.
#ifndef HYPERMAP_MAP_EDITS_EDIT_H_
#define HYPERMAP_MAP_EDITS_EDIT_H_

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/time/time.h"
#include "map/frames/frame_tree.h"
#include "map/grid/cell_cover.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"

namespace hypermap {

// ALREADY_EXISTS when the map has a layer of that name. An empty frame_id is the map's own.
struct CreateLayer {
  LayerSpec spec;
};

// NOT_FOUND when there is none.
struct DeleteLayer {
  std::string layer;
};

// Sets or replaces a frame's place in the tree.
struct SetTransform {
  FrameTransform transform;
};

// Adds the object (id 0: it gets the next id) or replaces the one with its id (in the same layer;
// another id that the map has not given yet is refused). The shape is given in `frame_id` (empty:
// the layer's own).
struct PutObject {
  std::string layer;
  SemanticObject object;
  std::string frame_id;
  // Whether an object that was removed may come back with the id it had.
  bool revive = false;
  // ABORTED unless the object has this version.
  std::optional<Revision> if_version;
  // From the batch's time on; sets SemanticObject::expires_at. Must be positive.
  std::optional<absl::Duration> time_to_live;
};

struct DeleteObject {
  std::string layer;
  ObjectId id = 0;
  // ABORTED unless the object has this version.
  std::optional<Revision> if_version;
};

// Sets a box of cells; `values` row-major, lowest row first, nullopt = unknown.
struct WriteCells {
  std::string layer;
  CellBox box;
  std::vector<std::optional<double>> values;
};

// Sets the cells that a polygon selects. `area` in `frame_id` (empty: the layer's own).
struct FillPolygon {
  std::string layer;
  Polygon area;
  std::string frame_id;
  CellRule rule = CellRule::kCentre;
  std::optional<double> value;
};

// Gives a semantic layer other words for its labels. Each alias named here gets its labels in place
// of those it had, or is taken out when it has none here; all others stay. Words are folded.
struct SetAliases {
  std::string layer;
  ValueAliases aliases;
};

using Edit = std::variant<CreateLayer, DeleteLayer, SetTransform, PutObject, DeleteObject,
                          WriteCells, FillPolygon, SetAliases>;

struct LayerVersion {
  std::string layer;
  Revision version = 0;
};

// All of it happens, as one revision, or none.
struct EditBatch {
  std::vector<Edit> edits;
  // ABORTED unless each of these layers has the version.
  std::vector<LayerVersion> if_layers;
  // When it is carried out.
  absl::Time time;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_EDIT_H_
