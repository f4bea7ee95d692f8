// The bounds of the transforms that clients set.
#ifndef HYPERMAP_MAP_FRAMES_FRAME_BOUNDS_H_
#define HYPERMAP_MAP_FRAMES_FRAME_BOUNDS_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "map/frames/frame_tree.h"

namespace hypermap {

// Largest number of transforms between a frame and the root of its tree. Bounds the cost of a
// lookup.
inline constexpr int kMaxFrameDepth = 256;
// Largest number of transforms of a map.
inline constexpr int64_t kMaxFrames = 20'000;

// Checks transforms before they are set, one after the other, in the same tree of frames. Trees
// beyond the bounds, which were stored before there were any, stay: their transforms can be
// replaced, and their frames can get a parent nearer to the root.
//
//   FrameBounds bounds;
//   for (const FrameTransform& transform : transforms) {
//     HYPERMAP_RETURN_IF_ERROR(bounds.Check(tree, transform));
//     HYPERMAP_RETURN_IF_ERROR(tree.Set(transform));
//   }
//
// A transform that replaces one between the same frames costs O(log n) for n frames, another one
// O(kMaxFrameDepth log n). Besides, the heights of all frames are computed once, in O(n log n), as
// soon as they are needed. Used by one thread.
class FrameBounds {
 public:
  FrameBounds();
  FrameBounds(const FrameBounds&) = delete;
  FrameBounds& operator=(const FrameBounds&) = delete;
  ~FrameBounds();

  // Returns whether `frames` may get this transform; the caller sets it next. INVALID_ARGUMENT for
  // the errors of FrameTree::Set, except that the caller finds cycles when it sets the transform,
  // and for a transform that is not IsWithinBounds. RESOURCE_EXHAUSTED if there would be more than
  // kMaxFrames transforms, or a frame with more than kMaxFrameDepth of them above it.
  absl::Status Check(const FrameTree& frames, const FrameTransform& transform);

  // The number of frames that were visited so far, a measure of the cost.
  int64_t num_visits() const { return num_visits_; }

 private:
  class Heights;

  // Returns the number of transforms above `frame_id`, at most kMaxFrameDepth. Returns -1 if the
  // frame `stop` is among the frames above or is the frame itself.
  int DepthOf(const FrameTree& frames, const std::string& frame_id, const std::string& stop);

  std::unique_ptr<Heights> heights_;  // Null until needed.
  int64_t num_visits_ = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FRAMES_FRAME_BOUNDS_H_
