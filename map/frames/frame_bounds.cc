#include "map/frames/frame_bounds.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap {

// The height of each frame: the number of transforms between it and the lowest frame below it, but
// at most kMaxFrameDepth. Since heights are capped, a change of one changes at most kMaxFrameDepth
// others, however deep the tree is.
class FrameBounds::Heights {
 public:
  // Adds the frames that it visits to `num_visits`, here and later.
  Heights(const FrameTree& frames, int64_t* num_visits) : num_visits_(num_visits) {
    for (const FrameTransform& transform : frames.transforms()) {
      const int child = IdOf(transform.child_frame_id);
      const int parent = IdOf(transform.parent_frame_id);
      frames_[child].parent = parent;
      ++frames_[parent].num_open;
    }
    // From the leaves up: a frame is ready when its children are.
    std::vector<int> ready;
    for (size_t i = 0; i < frames_.size(); ++i) {
      if (frames_[i].num_open == 0) ready.push_back(static_cast<int>(i));
    }
    while (!ready.empty()) {
      const int frame = ready.back();
      ready.pop_back();
      ++*num_visits_;
      const int parent = frames_[frame].parent;
      if (parent < 0) continue;
      ++frames_[parent].children_by_height[frames_[frame].height()];
      if (--frames_[parent].num_open == 0) ready.push_back(parent);
    }
  }

  int HeightOf(const std::string& frame_id) { return frames_[IdOf(frame_id)].height(); }

  // As FrameBounds::DepthOf.
  int DepthOf(const std::string& frame_id, const std::string& stop) {
    const int stop_id = IdOf(stop);
    int depth = 0;
    for (int frame = IdOf(frame_id); frame != stop_id; ++depth) {
      ++*num_visits_;
      frame = frames_[frame].parent;
      if (frame < 0 || depth == kMaxFrameDepth) return depth;
    }
    return -1;
  }

  // REQUIRES: `parent_id` is not below `child_id`, nor the same.
  void SetParent(const std::string& child_id, const std::string& parent_id) {
    const int child = IdOf(child_id);
    const int parent = IdOf(parent_id);
    const int height = frames_[child].height();
    const int parent_before = std::exchange(frames_[child].parent, parent);
    if (parent_before >= 0) ChangeChild(parent_before, height, kNoChild);
    ChangeChild(parent, kNoChild, height);
  }

 private:
  static constexpr int kNoChild = -1;

  struct Frame {
    int parent = -1;   // -1: a root.
    int num_open = 0;  // Children whose heights are not known yet.
    // The number of children of each height.
    absl::btree_map<int, int> children_by_height;

    int height() const {
      if (children_by_height.empty()) return 0;
      return std::min(children_by_height.rbegin()->first + 1, kMaxFrameDepth);
    }
  };

  int IdOf(const std::string& frame_id) {
    const auto [known, is_new] = ids_.try_emplace(frame_id, static_cast<int>(frames_.size()));
    if (is_new) frames_.emplace_back();
    return known->second;
  }

  // Replaces the height of a child of `frame`, and the heights of the frames above that change.
  void ChangeChild(int frame, int before, int after) {
    while (frame >= 0 && before != after) {
      ++*num_visits_;
      Frame& changed = frames_[frame];
      const int height_before = changed.height();
      if (before != kNoChild) {
        const auto same = changed.children_by_height.find(before);
        if (--same->second == 0) changed.children_by_height.erase(same);
      }
      if (after != kNoChild) ++changed.children_by_height[after];
      before = height_before;
      after = changed.height();
      frame = changed.parent;
    }
  }

  absl::flat_hash_map<std::string, int> ids_;
  std::vector<Frame> frames_;
  int64_t* const num_visits_;
};

FrameBounds::FrameBounds() = default;
FrameBounds::~FrameBounds() = default;

int FrameBounds::DepthOf(const FrameTree& frames, const std::string& frame_id,
                         const std::string& stop) {
  if (heights_) return heights_->DepthOf(frame_id, stop);
  int depth = 0;
  for (const std::string* frame = &frame_id; *frame != stop; ++depth) {
    ++num_visits_;
    const FrameTransform* const above = frames.Find(*frame);
    if (above == nullptr || depth == kMaxFrameDepth) return depth;
    frame = &above->parent_frame_id;
  }
  return -1;
}

absl::Status FrameBounds::Check(const FrameTree& frames, const FrameTransform& transform) {
  const std::string& parent = transform.parent_frame_id;
  const std::string& child = transform.child_frame_id;
  HYPERMAP_RETURN_IF_ERROR(FrameTree::CheckAlone(transform));
  HYPERMAP_RETURN_IF_ERROR(CheckTranslation("parent_from_child", transform.parent_from_child));
  const FrameTransform* const before = frames.Find(child);
  if (before != nullptr && before->parent_frame_id == parent) return absl::OkStatus();
  const auto num_frames = static_cast<int64_t>(frames.size());
  if (before == nullptr && num_frames >= kMaxFrames) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the map has ", num_frames, " transforms, the most are ", kMaxFrames));
  }
  // Climbing in the tree is the cheaper way for a few new frames without children.
  if (!heights_ && (frames.HasChildren(child) || num_visits_ > num_frames)) {
    heights_ = std::make_unique<Heights>(frames, &num_visits_);
  }
  const int depth_of_parent = DepthOf(frames, parent, child);
  if (depth_of_parent < 0) return absl::OkStatus();  // A cycle.
  const int height = heights_ ? heights_->HeightOf(child) : 0;
  if (depth_of_parent + 1 + height > kMaxFrameDepth) {
    return absl::ResourceExhaustedError(
        absl::StrCat("parent_frame_id: frame '", child, "', or one below it, would have more than ",
                     kMaxFrameDepth, " transforms between itself and its root"));
  }
  if (heights_) heights_->SetParent(child, parent);
  return absl::OkStatus();
}

}  // namespace hypermap
