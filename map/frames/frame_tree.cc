#include "map/frames/frame_tree.h"

#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap {
namespace {

absl::Status CheckName(absl::string_view field, absl::string_view frame_id) {
  if (frame_id.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(field, " must not be empty"));
  }
  if (frame_id.size() > kMaxFrameIdBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, " is longer than ", kMaxFrameIdBytes, " bytes"));
  }
  return absl::OkStatus();
}

}  // namespace

// Walks from a frame to the root of its tree, and accumulates the transform. Remembers the first
// transform on the way that is too long.
class FrameTree::Climber {
 public:
  Climber(const Edges& edges, absl::string_view start) : edges_(edges), frame_id_(start) {}

  absl::string_view frame_id() const { return frame_id_; }
  const PlanarTransform& frame_from_start() const { return frame_from_start_; }
  const absl::Status& status() const { return status_; }

  // Returns false at the root.
  bool Climb() {
    const auto edge = edges_.find(frame_id_);
    if (edge == edges_.end()) return false;
    const PlanarTransform& parent_from_child = edge->second.parent_from_child;
    if (status_.ok() && !IsWithinBounds(parent_from_child)) {
      status_ =
          CheckTranslation(absl::StrCat("transform of frame '", frame_id_, "'"), parent_from_child);
    }
    frame_from_start_ = parent_from_child * frame_from_start_;
    frame_id_ = edge->second.parent_frame_id;
    return true;
  }

 private:
  const Edges& edges_;
  absl::string_view frame_id_;
  PlanarTransform frame_from_start_;
  absl::Status status_;
};

int FrameTree::DepthOf(const Edges& edges, absl::string_view frame_id) {
  int depth = 0;
  for (auto edge = edges.find(frame_id); edge != edges.end();
       edge = edges.find(edge->second.parent_frame_id)) {
    ++depth;
  }
  return depth;
}

absl::Status FrameTree::CheckAlone(const FrameTransform& transform) {
  HYPERMAP_RETURN_IF_ERROR(CheckName("parent_frame_id", transform.parent_frame_id));
  HYPERMAP_RETURN_IF_ERROR(CheckName("child_frame_id", transform.child_frame_id));
  const PlanarTransform& t = transform.parent_from_child;
  if (std::isfinite(t.x()) && std::isfinite(t.y()) && std::isfinite(t.yaw())) {
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError("parent_from_child is not finite");
}

absl::Status FrameTree::Set(const FrameTransform& transform) {
  const std::string& parent = transform.parent_frame_id;
  const std::string& child = transform.child_frame_id;
  HYPERMAP_RETURN_IF_ERROR(CheckAlone(transform));
  const FrameTransform* const before = Find(child);
  const bool has_parent = before != nullptr && before->parent_frame_id == parent;
  // Only a frame that gets another parent can become its own ancestor, and only through its
  // children. Trees that grow at their leaves, as most do, need no walk to the root.
  if (!has_parent && (child == parent || num_children_.contains(child))) {
    Climber climber(by_child_, parent);
    do {
      if (climber.frame_id() == child) {
        return absl::InvalidArgumentError(absl::StrCat(
            "parent_frame_id: frame '", child, "' would be its own ancestor under '", parent, "'"));
      }
    } while (climber.Climb());
  }
  if (!has_parent) {
    if (before != nullptr) AddChildren(before->parent_frame_id, -1);
    AddChildren(parent, 1);
  }
  by_child_.insert_or_assign(child, transform);
  return absl::OkStatus();
}

void FrameTree::AddChildren(const std::string& frame_id, int64_t number) {
  const auto known = num_children_.find(frame_id);
  const int64_t sum = number + (known == num_children_.end() ? 0 : known->second);
  if (sum > 0) {
    num_children_.insert_or_assign(frame_id, sum);
  } else {
    num_children_.erase(frame_id);
  }
}

const FrameTransform* FrameTree::Find(absl::string_view child_frame_id) const {
  const auto edge = by_child_.find(child_frame_id);
  return edge == by_child_.end() ? nullptr : &edge->second;
}

bool FrameTree::Contains(absl::string_view frame_id) const {
  return by_child_.contains(frame_id) || num_children_.contains(frame_id);
}

absl::StatusOr<PlanarTransform> FrameTree::Lookup(absl::string_view target_frame_id,
                                                  absl::string_view source_frame_id) const {
  if (target_frame_id == source_frame_id) return PlanarTransform();
  Climber target(by_child_, target_frame_id);
  Climber source(by_child_, source_frame_id);
  int above = DepthOf(by_child_, target_frame_id) - DepthOf(by_child_, source_frame_id);
  for (; above > 0; --above) target.Climb();
  for (; above < 0; ++above) source.Climb();
  while (target.frame_id() != source.frame_id()) {
    if (!target.Climb() || !source.Climb()) {
      return absl::NotFoundError(absl::StrCat("no transform between frames '", target_frame_id,
                                              "' and '", source_frame_id, "'"));
    }
  }
  HYPERMAP_RETURN_IF_ERROR(target.status());
  HYPERMAP_RETURN_IF_ERROR(source.status());
  const PlanarTransform target_from_source =
      target.frame_from_start().Inverse() * source.frame_from_start();
  if (std::hypot(target_from_source.x(), target_from_source.y()) > kMaxFrameDistance_m) {
    return absl::InvalidArgumentError(absl::StrCat("frames '", target_frame_id, "' and '",
                                                   source_frame_id, "' are more than ",
                                                   kMaxFrameDistance_m, " m apart"));
  }
  return target_from_source;
}

std::vector<FrameTransform> FrameTree::transforms() const {
  std::vector<FrameTransform> all;
  all.reserve(by_child_.size());
  for (const auto& [child, edge] : by_child_) all.push_back(edge);
  return all;
}

int64_t FrameTree::UnsharedBytes(const FrameTree& older) const {
  using ChildCounts = decltype(num_children_);
  int64_t bytes = 0;
  by_child_.VisitUnshared(older.by_child_, [&](const auto& entry, const auto* before) {
    bytes += Edges::kNodeBytes;
    if (before == &entry) return;
    bytes += static_cast<int64_t>(sizeof entry + 2 * entry.first.size() +
                                  entry.second.parent_frame_id.size());
  });
  num_children_.VisitUnshared(older.num_children_, [&](const auto& entry, const auto* before) {
    bytes += ChildCounts::kNodeBytes;
    if (before != &entry) bytes += static_cast<int64_t>(sizeof entry + entry.first.size());
  });
  return bytes;
}

}  // namespace hypermap
