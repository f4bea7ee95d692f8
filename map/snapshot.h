// A hypermap at one revision: the set of layers with their frames, as one immutable value.
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

// Counts the commits of a map; 0 is the map as it was created, before its first edit.
using Revision = int64_t;

using LayerMap = std::map<std::string, LayerPtr, std::less<>>;

// Copying is cheap (layers are shared). Safe to read from many threads.
struct Snapshot {
  std::string map_name;
  // The map's own frame: what an empty frame_id means.
  std::string frame_id = "map";
  Revision revision = 0;
  FrameTree frames;
  LayerMap layers;
  // By layer: the newest revision that changed it or its content.
  std::map<std::string, Revision, std::less<>> layer_versions;
  // The id that the next new object gets.
  ObjectId next_object_id = 1;

  // Null when there is none.
  const Layer* FindLayer(absl::string_view name) const;
  // The layer as one of cells or of objects. Null when there is none of that name, or it is not
  // one.
  const GridLayer* FindGrid(absl::string_view name) const;
  const SemanticLayer* FindSemantic(absl::string_view name) const;
  // Of `layer_versions`; 0 when there is no such layer.
  Revision LayerVersionOf(absl::string_view layer) const;
  // NOT_FOUND naming the layer and the map.
  absl::StatusOr<LayerPtr> GetLayer(absl::string_view name) const;
  // The named layers in the order asked, once each; all when `names` is empty. NOT_FOUND.
  absl::StatusOr<std::vector<LayerPtr>> SelectLayers(const std::vector<std::string>& names) const;
  // Whether any transform or layer uses the frame, or it is the map's own.
  bool KnowsFrame(absl::string_view frame_id) const;
  // `frame_id`, or the map's own for an empty one. NOT_FOUND for a frame the map does not know.
  absl::StatusOr<std::string> ResolveFrame(absl::string_view frame_id) const;
};

using SnapshotPtr = std::shared_ptr<const Snapshot>;

}  // namespace hypermap

#endif  // HYPERMAP_MAP_SNAPSHOT_H_
