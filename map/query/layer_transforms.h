// The transforms of one question. Private to this folder.
#ifndef HYPERMAP_MAP_QUERY_LAYER_TRANSFORMS_H_
#define HYPERMAP_MAP_QUERY_LAYER_TRANSFORMS_H_

#include <optional>
#include <string>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/snapshot.h"

namespace hypermap {

// Finds the transforms from layers to the caller's frame. Each frame is looked up once, whatever
// the number of layers in it. Used by one thread at a time.
class LayerTransforms {
 public:
  // `snapshot` must outlive this.
  LayerTransforms(const Snapshot& snapshot, std::string caller_frame_id)
      : snapshot_(&snapshot), caller_frame_id_(std::move(caller_frame_id)) {}

  const std::string& caller_frame_id() const { return caller_frame_id_; }

  // Returns caller_from_layer. nullopt if the layer's frame is not connected to the caller's, or if
  // the layer's coordinates are too large for it: FrameTree::Lookup has no answer, or the origin of
  // a grid is not IsWithinBounds.
  std::optional<PlanarTransform> CallerFromLayer(const Layer& layer);

  // Looks up the frame of a layer for a later CallerFromLayer. Errors of CheckCancelled.
  absl::Status Prepare(const Layer& layer);

 private:
  const Snapshot* snapshot_;
  std::string caller_frame_id_;
  // By the frame of the layer; the caller's frame is left out. The keys are those of the layers.
  absl::flat_hash_map<absl::string_view, std::optional<PlanarTransform>> found_;
};

// Returns layer_from_caller * p with finite coordinates: those that are too large become the
// largest double. REQUIRES: `p` is finite, and the transform that of a LayerTransforms.
Point InLayer(const PlanarTransform& layer_from_caller, const Point& p);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_QUERY_LAYER_TRANSFORMS_H_
