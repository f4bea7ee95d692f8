#include "map/fusion/track_index.h"

#include <algorithm>
#include <utility>

#include "base/cancellation/cancellation.h"

namespace hypermap::fusion {
namespace {

// Most tracks that a search compares one by one. Balances these comparisons against the packing of
// trees.
constexpr size_t kMaxRecentTracks = 64;

}  // namespace

void TrackIndex::Add(const TrackKey& key, const Box& box) {
  by_key_.emplace(key, boxes_.size());
  recent_.push_back(static_cast<int32_t>(boxes_.size()));
  is_recent_.push_back(true);
  boxes_.push_back(box);
}

void TrackIndex::Move(size_t track, const Box& box) {
  if (boxes_[track] == box) return;
  boxes_[track] = box;
  if (is_recent_[track]) return;
  is_recent_[track] = true;
  recent_.push_back(static_cast<int32_t>(track));
}

std::optional<size_t> TrackIndex::Find(const TrackKey& key, const Box& box, double least,
                                       absl::FunctionRef<double(size_t)> score) {
  if (const auto known = by_key_.find(key); known != by_key_.end()) return known->second;
  if (recent_.size() > kMaxRecentTracks) Pack();
  std::optional<size_t> best;
  double best_score = least;
  // The result does not depend on the order of the visits.
  const auto compare = [&](int32_t track) {
    if (!boxes_[track].Intersects(box) || IsCancelled()) return;
    const auto candidate = static_cast<size_t>(track);
    const double own = score(candidate);
    const bool is_best = own > best_score || (own == best_score && (!best || candidate > *best));
    if (!is_best) return;
    best = candidate;
    best_score = own;
  };
  for (const PackedRTree& tree : trees_) tree.Visit(box, compare);
  for (const int32_t track : recent_) compare(track);
  return best;
}

void TrackIndex::Pack() {
  std::vector<int32_t> tracks = std::exchange(recent_, {});
  for (const int32_t track : tracks) is_recent_[track] = false;
  while (!trees_.empty() && static_cast<size_t>(trees_.back().size()) <= tracks.size()) {
    trees_.back().VisitAll([&tracks](int track) { tracks.push_back(track); });
    trees_.pop_back();
  }
  // A track that has moved may be in several trees.
  std::sort(tracks.begin(), tracks.end());
  tracks.erase(std::unique(tracks.begin(), tracks.end()), tracks.end());
  std::vector<Box> boxes;
  boxes.reserve(tracks.size());
  for (const int32_t track : tracks) boxes.push_back(boxes_[track]);
  const std::vector<uint32_t> places = HilbertKeys(boxes);
  std::vector<std::pair<uint32_t, int32_t>> by_place;
  by_place.reserve(tracks.size());
  for (size_t i = 0; i < tracks.size(); ++i) by_place.emplace_back(places[i], tracks[i]);
  std::sort(by_place.begin(), by_place.end());
  for (size_t i = 0; i < tracks.size(); ++i) tracks[i] = by_place[i].second;
  trees_.emplace_back(boxes_, std::move(tracks));
}

}  // namespace hypermap::fusion
