// Edits of a map.
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

// ALREADY_EXISTS if the map has a layer with this name. An empty frame_id stands for the map's own
// frame. INVALID_ARGUMENT if the origin of its grid is not IsWithinBounds.
struct CreateLayer {
  LayerSpec spec;
};

// NOT_FOUND if there is no such layer.
struct DeleteLayer {
  std::string layer;
};

// Sets or replaces the parent of a frame. The errors are those of FrameBounds::Check and
// FrameTree::Set.
struct SetTransform {
  FrameTransform transform;
};

// Adds an object (id 0: it gets the next id) or replaces the one with its id, which must be in the
// same layer. Ids that the map has not assigned yet are refused. The shape is in `frame_id` (empty:
// the layer's own frame); it must be valid in the layer's frame, too (see Moved in map/frames).
struct PutObject {
  std::string layer;
  SemanticObject object;
  std::string frame_id;
  // True if an object that was removed may be put again with its old id.
  bool revive = false;
  // ABORTED unless the object has this version.
  std::optional<Revision> if_version;
  // Counts from the time of the batch; sets SemanticObject::expires_at. Must be positive.
  std::optional<absl::Duration> time_to_live;
};

struct DeleteObject {
  std::string layer;
  ObjectId id = 0;
  // ABORTED unless the object has this version.
  std::optional<Revision> if_version;
};

// Sets a box of cells. `values` is row-major, lowest row first; nullopt means unknown.
struct WriteCells {
  std::string layer;
  CellBox box;
  std::vector<std::optional<double>> values;
};

// Sets the cells that a polygon selects. `area` is in `frame_id` (empty: the layer's own frame).
struct FillPolygon {
  std::string layer;
  Polygon area;
  std::string frame_id;
  CellRule rule = CellRule::kCentre;
  std::optional<double> value;
};

// Sets additional words for the labels of a semantic layer. Each alias given here gets these labels
// instead of its former ones, and is removed if it has none here; other aliases stay. Words are
// folded.
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

// A batch is applied as a whole, as one revision, or not at all.
struct EditBatch {
  std::vector<Edit> edits;
  // ABORTED unless each of these layers has this version.
  std::vector<LayerVersion> if_layers;
  // The time at which it is applied.
  absl::Time time;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_EDIT_H_
