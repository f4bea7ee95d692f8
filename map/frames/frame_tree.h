// Named frames and the rigid transforms between them.
#ifndef HYPERMAP_MAP_FRAMES_FRAME_TREE_H_
#define HYPERMAP_MAP_FRAMES_FRAME_TREE_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/containers/shared_map.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/coordinates.h"

namespace hypermap {

// Maximal length of a frame's name in bytes.
inline constexpr int kMaxFrameIdBytes = 63;

// Largest distance between the origins of two frames in metres, for which FrameTree::Lookup has an
// answer. Every transform that FrameBounds accepts is shorter, in both directions.
inline constexpr double kMaxFrameDistance_m = 2.0 * kMaxCoordinate_m;

// One edge of the tree.
struct FrameTransform {
  std::string parent_frame_id;
  std::string child_frame_id;
  PlanarTransform parent_from_child;

  friend bool operator==(const FrameTransform&, const FrameTransform&) = default;
};

// A forest of frames: each frame has at most one parent. Coordinates can be converted between the
// frames of one tree. A value, cheap to copy, since copies share their transforms; safe to read
// from many threads.
class FrameTree {
 public:
  // The errors of Set that do not depend on other transforms.
  static absl::Status CheckAlone(const FrameTransform& transform);

  // Sets or replaces the parent of `child_frame_id`. INVALID_ARGUMENT for a name that is empty or
  // too long, a frame that would become its own ancestor, or a transform that is not finite.
  // Logarithmic in the number of frames; linear in the depth of the parent if a frame with children
  // gets another parent. Has no other bounds, so that stored trees can be restored; FrameBounds
  // checks the transforms that clients set.
  absl::Status Set(const FrameTransform& transform);

  // Returns the edge from the frame to its parent; null if it has none.
  const FrameTransform* Find(absl::string_view child_frame_id) const;

  // Returns whether a transform names the frame.
  bool Contains(absl::string_view frame_id) const;
  // Returns whether a transform names the frame as parent.
  bool HasChildren(absl::string_view frame_id) const { return num_children_.contains(frame_id); }
  // Returns the number of transforms.
  size_t size() const { return by_child_.size(); }

  // Returns target_from_source. NOT_FOUND if the frames are not connected; a frame is always
  // connected to itself, even if it is not known. INVALID_ARGUMENT if a transform between them
  // is not IsWithinBounds, or their origins are more than kMaxFrameDistance_m apart. Linear in the
  // depth of the tree.
  absl::StatusOr<PlanarTransform> Lookup(absl::string_view target_frame_id,
                                         absl::string_view source_frame_id) const;

  // Returns all edges, sorted by child.
  std::vector<FrameTransform> transforms() const;

  // Bytes of memory that this does not share with `older`.
  int64_t UnsharedBytes(const FrameTree& older) const;

 private:
  using Edges = SharedMap<std::string, FrameTransform>;

  class Climber;

  static int DepthOf(const Edges& edges, absl::string_view frame_id);
  void AddChildren(const std::string& frame_id, int64_t number);

  Edges by_child_;
  SharedMap<std::string, int64_t> num_children_;  // By parent; at least 1.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_FRAMES_FRAME_TREE_H_
