// A hypermap at one revision: its layers and frames as one immutable value.
#ifndef HYPERMAP_MAP_SNAPSHOT_H_
#define HYPERMAP_MAP_SNAPSHOT_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/frames/frame_tree.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap {

// The number of commits of a map; 0 is the map as created, before its first edit.
using Revision = int64_t;

using LayerMap = std::map<std::string, LayerPtr, std::less<>>;

// A layer whose stored content can't be read.
struct DamagedLayer {
  LayerPtr empty;       // With its spec and extent, but without content.
  absl::Status damage;  // DATA_LOSS naming what can't be read.
};

// Cheap to copy, since layers are shared. Safe to read from many threads.
struct Snapshot {
  std::string map_name;
  // The map's own frame, which an empty frame_id stands for.
  std::string frame_id = "map";
  Revision revision = 0;
  FrameTree frames;
  LayerMap layers;
  // Layers that are not in `layers`, because they can't be read. Their names are taken.
  std::map<std::string, DamagedLayer, std::less<>> damaged;
  // By layer, damaged or not: the newest revision that changed the layer or its content.
  std::map<std::string, Revision, std::less<>> layer_versions;
  // The id of the next new object.
  ObjectId next_object_id = 1;

  // Returns null if there is no such layer, or it is damaged.
  const Layer* FindLayer(absl::string_view name) const;
  // Return the layer as a grid or as a semantic layer; null if there is no such layer, or it has
  // another kind.
  const GridLayer* FindGrid(absl::string_view name) const;
  const SemanticLayer* FindSemantic(absl::string_view name) const;
  // Returns the version in `layer_versions`; 0 if there is no such layer.
  Revision LayerVersionOf(absl::string_view layer) const;
  // Returns whether the name is that of a layer, damaged or not.
  bool HasLayer(absl::string_view name) const;
  // NOT_FOUND naming the layer and the map; DATA_LOSS if the layer is damaged.
  absl::StatusOr<LayerPtr> GetLayer(absl::string_view name) const;
  // Returns the named layers in the order given, without repetitions; all layers if `names` is
  // empty. NOT_FOUND; DATA_LOSS if one of them is damaged.
  absl::StatusOr<std::vector<LayerPtr>> SelectLayers(const std::vector<std::string>& names) const;
  // Does the same for callers that answer for each layer: DamagedLayer::empty stands for a damaged
  // layer, and follows the others if `names` is empty.
  absl::StatusOr<std::vector<LayerPtr>> SelectToAnswer(const std::vector<std::string>& names) const;
  // Returns whether SelectToAnswer returned `layer` for a damaged one.
  bool IsDamaged(const Layer& layer) const;
  // OK if none of the named layers is damaged; of all layers if `names` is empty. DATA_LOSS.
  absl::Status CheckUndamaged(const std::vector<std::string>& names) const;
  // Returns whether a transform or a layer uses the frame, or it is the map's own.
  bool KnowsFrame(absl::string_view frame_id) const;
  // Returns `frame_id`, or the map's own frame if it is empty. NOT_FOUND for a frame that the map
  // does not know.
  absl::StatusOr<std::string> ResolveFrame(absl::string_view frame_id) const;
};

using SnapshotPtr = std::shared_ptr<const Snapshot>;

}  // namespace hypermap

#endif  // HYPERMAP_MAP_SNAPSHOT_H_
