#include "server/fusion/checkpoints.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace hypermap::server {
namespace {

constexpr size_t kMaxCheckpoints = 128;

}  // namespace

size_t MostDispensable(absl::Span<const int64_t> positions, int64_t end) {
  size_t best = 1;
  double best_ratio = 0.0;
  for (size_t i = 1; i + 1 < positions.size(); ++i) {
    // The worst case: the log changes just before the next checkpoint.
    const auto folded = static_cast<double>(end - positions[i - 1]);
    const auto needed = static_cast<double>(end - positions[i + 1] + 1);
    if (i > 1 && folded / needed >= best_ratio) continue;
    best = i;
    best_ratio = folded / needed;
  }
  return best;
}

Checkpoints::Checkpoints(std::shared_ptr<const fusion::Strategy> strategy, absl::Duration max_age,
                         int64_t max_bytes)
    : strategy_(std::move(strategy)), max_age_(max_age), max_bytes_(max_bytes) {}

void Checkpoints::Add(const FoldPoint& point) {
  kept_.insert_or_assign(point.key, Kept{point.state, point.position});
  CountUnshared(std::prev(kept_.end()));
  Trim();
}

void Checkpoints::DropFrom(const storage::LogKey& key) {
  kept_.erase(kept_.lower_bound(key), kept_.end());
}

void Checkpoints::DropBefore(const storage::LogKey& key) {
  kept_.erase(kept_.begin(), kept_.lower_bound(key));
}

int64_t Checkpoints::Append(const Checkpoints& other) {
  auto next = other.kept_.begin();
  int64_t shift = 0;
  if (!kept_.empty()) {
    const auto& [key, newest] = *std::prev(kept_.end());
    next = other.kept_.upper_bound(key);
    if (next != other.kept_.end()) {
      shift = std::max<int64_t>(0, newest.position + 1 - next->second.position);
    }
  }
  for (; next != other.kept_.end(); ++next) {
    Add({next->first, next->second.state, next->second.position + shift});
  }
  return shift;
}

std::optional<FoldPoint> Checkpoints::Newest() const {
  if (kept_.empty()) return std::nullopt;
  const auto& [key, kept] = *std::prev(kept_.end());
  return FoldPoint{key, kept.state, kept.position};
}

std::optional<FoldPoint> Checkpoints::Before(const storage::LogKey& key) const {
  const auto after = kept_.lower_bound(key);
  if (after == kept_.begin()) return std::nullopt;
  const auto& [before, kept] = *std::prev(after);
  return FoldPoint{before, kept.state, kept.position};
}

int64_t Checkpoints::Bytes(const fusion::StatePtr& newer) const {
  if (kept_.empty()) return 0;
  const auto newest = std::prev(kept_.end());
  int64_t bytes = strategy_->ByteSize(newest->second.state, newer);
  for (auto it = kept_.begin(); it != newest; ++it) bytes += it->second.unshared;
  return bytes;
}

void Checkpoints::CountUnshared(Map::iterator newer) {
  if (newer == kept_.begin() || newer == kept_.end()) return;
  Kept& older = std::prev(newer)->second;
  older.unshared = strategy_->ByteSize(older.state, newer->second.state);
}

void Checkpoints::Trim() {
  const absl::Time too_old = std::prev(kept_.end())->first.after.stamp - max_age_;
  while (kept_.size() >= 2 && std::next(kept_.begin())->first.after.stamp < too_old) {
    kept_.erase(kept_.begin());
  }
  int64_t bytes = 0;
  for (auto it = kept_.begin(); it != std::prev(kept_.end()); ++it) bytes += it->second.unshared;
  while (kept_.size() > kMaxCheckpoints || (bytes > max_bytes_ && kept_.size() > 1)) {
    auto dropped = kept_.begin();
    if (kept_.size() >= 3) {
      std::vector<int64_t> positions;
      for (const auto& [key, kept] : kept_) positions.push_back(kept.position);
      std::advance(dropped, MostDispensable(positions, positions.back()));
    }
    bytes -= dropped->second.unshared;
    const bool is_first = dropped == kept_.begin();
    if (!is_first) bytes -= std::prev(dropped)->second.unshared;
    const auto next = kept_.erase(dropped);
    CountUnshared(next);
    if (!is_first) bytes += std::prev(next)->second.unshared;
  }
}

}  // namespace hypermap::server
