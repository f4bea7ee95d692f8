#include "client_libs/ros2/bridge/transform_buffer.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::Duration kKept = absl::Seconds(10);
// For this long before the first sample and after the newest one, that sample counts.
constexpr absl::Duration kHold = absl::Milliseconds(20);
constexpr size_t kMaxFrames = 10'000;

// Names had a slash at the beginning in ROS 1.
std::string FrameName(absl::string_view name) { return std::string(absl::StripPrefix(name, "/")); }

}  // namespace

absl::Status TransformBuffer::Add(const geometry_msgs::TransformStamped& message, bool is_static) {
  const std::string parent = FrameName(message.header.frame_id);
  const std::string child = FrameName(message.child_frame_id);
  if (parent.empty() || child.empty() || parent == child) {
    return absl::InvalidArgumentError(
        absl::StrCat("a transform from \"", parent, "\" to \"", child, "\""));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const RigidTransform transform, ToRigidTransform(message.transform));
  const bool is_known = static_.contains(child) || moving_.contains(child);
  if (!is_known && static_.size() + moving_.size() >= kMaxFrames) {
    return absl::ResourceExhaustedError(absl::StrCat("more than ", kMaxFrames, " frames"));
  }
  if (is_static) {
    static_[child] = {parent, transform};
  } else {
    AddSample(parent, FromStamp(message.header.stamp), transform, &moving_[child]);
  }
  return absl::OkStatus();
}

void TransformBuffer::AddSample(const std::string& parent, absl::Time stamp,
                                const RigidTransform& sample, Moving* moving) {
  Samples& samples = moving->samples;
  const bool is_set_back = !samples.empty() && samples.rbegin()->first - stamp > kKept;
  if (moving->parent != parent || is_set_back) samples.clear();
  moving->parent = parent;
  samples.insert_or_assign(stamp, sample);
  samples.erase(samples.begin(), samples.lower_bound(samples.rbegin()->first - kKept));
}

const std::string* TransformBuffer::ParentOf(const std::string& frame) const {
  if (const auto it = moving_.find(frame); it != moving_.end()) return &it->second.parent;
  if (const auto it = static_.find(frame); it != static_.end()) return &it->second.parent;
  return nullptr;
}

absl::StatusOr<TransformBuffer::Chain> TransformBuffer::ChainFrom(const std::string& frame) const {
  Chain chain = {frame};
  std::set<absl::string_view> visited = {frame};
  while (const std::string* const parent = ParentOf(chain.back())) {
    if (!visited.insert(*parent).second) {
      return absl::UnavailableError(
          absl::StrCat("the transforms to frame ", frame, " are a circle"));
    }
    chain.push_back(*parent);
  }
  return chain;
}

absl::StatusOr<TransformBuffer::Path> TransformBuffer::PathBetween(
    const std::string& target, const std::string& source) const {
  HYPERMAP_ASSIGN_OR_RETURN(Chain from_source, ChainFrom(source));
  HYPERMAP_ASSIGN_OR_RETURN(Chain from_target, ChainFrom(target));
  if (from_source.back() != from_target.back()) {
    return absl::UnavailableError(
        absl::StrCat("no transform from ", target, " to ", source, "; known are ", KnownFrames()));
  }
  while (!from_source.empty() && !from_target.empty() && from_source.back() == from_target.back()) {
    from_source.pop_back();
    from_target.pop_back();
  }
  return Path{std::move(from_source), std::move(from_target)};
}

absl::StatusOr<RigidTransform> TransformBuffer::At(const std::string& target,
                                                   const std::string& source, absl::Time stamp,
                                                   AfterNewest after_newest) const {
  HYPERMAP_ASSIGN_OR_RETURN(const Path path, PathBetween(target, source));
  return Along(path, stamp, after_newest);
}

absl::StatusOr<TransformBuffer::Stamped> TransformBuffer::Newest(const std::string& target,
                                                                 const std::string& source) const {
  HYPERMAP_ASSIGN_OR_RETURN(const Path path, PathBetween(target, source));
  absl::Time stamp = absl::InfiniteFuture();
  for (const Chain* const chain : {&path.from_source, &path.from_target}) {
    for (const std::string& frame : *chain) {
      const auto moving = moving_.find(frame);
      if (moving == moving_.end()) continue;
      stamp = std::min(stamp, moving->second.samples.rbegin()->first);
    }
  }
  if (stamp == absl::InfiniteFuture()) {
    return absl::UnavailableError(
        absl::StrCat("only static transforms lead from ", target, " to ", source));
  }
  HYPERMAP_ASSIGN_OR_RETURN(const RigidTransform transform,
                            Along(path, stamp, AfterNewest::kNothing));
  return Stamped{transform, stamp};
}

absl::StatusOr<RigidTransform> TransformBuffer::Along(const Path& path, absl::Time stamp,
                                                      AfterNewest after_newest) const {
  HYPERMAP_ASSIGN_OR_RETURN(const RigidTransform common_from_source,
                            Compose(path.from_source, stamp, after_newest));
  if (path.from_target.empty()) return common_from_source;
  HYPERMAP_ASSIGN_OR_RETURN(const RigidTransform common_from_target,
                            Compose(path.from_target, stamp, after_newest));
  return common_from_target.Inverse() * common_from_source;
}

absl::StatusOr<RigidTransform> TransformBuffer::Compose(const Chain& chain, absl::Time stamp,
                                                        AfterNewest after_newest) const {
  RigidTransform composed;
  for (const std::string& frame : chain) {
    HYPERMAP_ASSIGN_OR_RETURN(const RigidTransform parent_from_frame,
                              InParent(frame, stamp, after_newest));
    composed = parent_from_frame * composed;
  }
  return composed;
}

absl::StatusOr<RigidTransform> TransformBuffer::InParent(const std::string& frame, absl::Time stamp,
                                                         AfterNewest after_newest) const {
  const auto moving = moving_.find(frame);
  if (moving == moving_.end()) return static_.at(frame).parent_from_frame;
  const Samples& samples = moving->second.samples;
  const auto after = samples.lower_bound(stamp);
  if (after == samples.end()) {
    const auto& [newest, sample] = *samples.rbegin();
    if (after_newest == AfterNewest::kHolds && stamp - newest <= kHold) return sample;
    return absl::UnavailableError(absl::StrCat("frame ", frame, " is not known as late"));
  }
  if (after->first == stamp) return after->second;
  if (after == samples.begin()) {
    if (after->first - stamp <= kHold) return after->second;
    return absl::OutOfRangeError(absl::StrCat("frame ", frame, " is not known as early"));
  }
  const auto before = std::prev(after);
  const absl::Duration gap = after->first - before->first;
  if (gap > max_gap_) return absl::OutOfRangeError(absl::StrCat("gap in the poses of ", frame));
  return Interpolate(before->second, after->second, absl::FDivDuration(stamp - before->first, gap));
}

std::string TransformBuffer::KnownFrames() const {
  std::set<absl::string_view> names;
  for (const auto& [frame, transform] : static_) names.insert({frame, transform.parent});
  for (const auto& [frame, transform] : moving_) names.insert({frame, transform.parent});
  return names.empty() ? "none" : absl::StrJoin(names, ", ");
}

}  // namespace hypermap::ros2
