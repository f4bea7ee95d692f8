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

// Cheap to copy, since layers are shared. Safe to read from many threads.
struct Snapshot {
  std::string map_name;
  // The map's own frame, which an empty frame_id stands for.
  std::string frame_id = "map";
  Revision revision = 0;
  FrameTree frames;
  LayerMap layers;
  // By layer: the newest revision that changed the layer or its content.
  std::map<std::string, Revision, std::less<>> layer_versions;
  // The id of the next new object.
  ObjectId next_object_id = 1;

  // Returns null if there is no such layer.
  const Layer* FindLayer(absl::string_view name) const;
  // Return the layer as a grid or as a semantic layer; null if there is no such layer, or it has
  // another kind.
  const GridLayer* FindGrid(absl::string_view name) const;
  const SemanticLayer* FindSemantic(absl::string_view name) const;
  // Returns the version in `layer_versions`; 0 if there is no such layer.
  Revision LayerVersionOf(absl::string_view layer) const;
  // NOT_FOUND naming the layer and the map.
  absl::StatusOr<LayerPtr> GetLayer(absl::string_view name) const;
  // Returns the named layers in the order given, without repetitions; all layers if `names` is
  // empty. NOT_FOUND.
  absl::StatusOr<std::vector<LayerPtr>> SelectLayers(const std::vector<std::string>& names) const;
  // Returns whether a transform or a layer uses the frame, or it is the map's own.
  bool KnowsFrame(absl::string_view frame_id) const;
  // Returns `frame_id`, or the map's own frame if it is empty. NOT_FOUND for a frame that the map
  // does not know.
  absl::StatusOr<std::string> ResolveFrame(absl::string_view frame_id) const;
};

using SnapshotPtr = std::shared_ptr<const Snapshot>;

}  // namespace hypermap

#endif  // HYPERMAP_MAP_SNAPSHOT_H_
