// Named frames and the rigid transforms between them.
#ifndef HYPERMAP_MAP_FRAMES_FRAME_TREE_H_
#define HYPERMAP_MAP_FRAMES_FRAME_TREE_H_

#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/frames/planar_transform.h"

namespace hypermap {

// Longest name of a frame, bytes.
inline constexpr int kMaxFrameIdBytes = 63;

// One edge of the tree.
struct FrameTransform {
  std::string parent_frame_id;
  std::string child_frame_id;
  PlanarTransform parent_from_child;

  friend bool operator==(const FrameTransform&, const FrameTransform&) = default;
};

// A forest of frames: each frame has at most one parent. Frames of one tree can be converted into
// each other. A value: copy to change, safe to read from many threads.
class FrameTree {
 public:
  // Sets or replaces the parent of `child_frame_id`. INVALID_ARGUMENT for an empty or too long
  // name, a frame that would be its own ancestor, or a transform that is not finite.
  absl::Status Set(const FrameTransform& transform);

  // Whether any transform names the frame.
  bool Contains(absl::string_view frame_id) const;

  // target_from_source. NOT_FOUND when the two are not connected; a frame is always connected to
  // itself, known or not. Linear in the depth of the tree.
  absl::StatusOr<PlanarTransform> Lookup(absl::string_view target_frame_id,
                                         absl::string_view source_frame_id) const;

  // All edges, sorted by child.
  std::vector<FrameTransform> transforms() const;

 private:
  std::map<std::string, FrameTransform, std::less<>> by_child_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FRAMES_FRAME_TREE_H_
