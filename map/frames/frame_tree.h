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

// Maximal length of a frame's name in bytes.
inline constexpr int kMaxFrameIdBytes = 63;

// One edge of the tree.
struct FrameTransform {
  std::string parent_frame_id;
  std::string child_frame_id;
  PlanarTransform parent_from_child;

  friend bool operator==(const FrameTransform&, const FrameTransform&) = default;
};

// A forest of frames: each frame has at most one parent. Coordinates can be converted between the
// frames of one tree. A value; safe to read from many threads.
class FrameTree {
 public:
  // Sets or replaces the parent of `child_frame_id`. INVALID_ARGUMENT for a name that is empty or
  // too long, a frame that would become its own ancestor, or a transform that is not finite.
  absl::Status Set(const FrameTransform& transform);

  // Returns whether a transform names the frame.
  bool Contains(absl::string_view frame_id) const;

  // Returns target_from_source. NOT_FOUND if the frames are not connected; a frame is always
  // connected to itself, even if it is not known. Linear in the depth of the tree.
  absl::StatusOr<PlanarTransform> Lookup(absl::string_view target_frame_id,
                                         absl::string_view source_frame_id) const;

  // Returns all edges, sorted by child.
  std::vector<FrameTransform> transforms() const;

 private:
  std::map<std::string, FrameTransform, std::less<>> by_child_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FRAMES_FRAME_TREE_H_
