#include "map/fusion/track_list.h"

#include <algorithm>
#include <utility>

#include "absl/container/flat_hash_set.h"

namespace hypermap::fusion {
namespace {

void Add(TrackPtr track, TrackList::Run* run) {
  run->boxes.push_back(track->outline.bounds());
  run->bounds.Extend(run->boxes.back());
  run->bytes += ByteSize(*track);
  run->tracks.push_back(std::move(track));
}

// Removes the tracks that are null, and computes the bounds.
void Tidy(TrackList::Run* run) {
  size_t kept = 0;
  run->bounds = Box();
  for (size_t i = 0; i < run->tracks.size(); ++i) {
    if (!run->tracks[i]) continue;
    run->bounds.Extend(run->boxes[i]);
    if (kept != i) {
      run->tracks[kept] = std::move(run->tracks[i]);
      run->boxes[kept] = run->boxes[i];
    }
    ++kept;
  }
  run->tracks.resize(kept);
  run->boxes.resize(kept);
}

TrackList::RunPtr Joined(const TrackList::Run& a, const TrackList::Run& b) {
  auto joined = std::make_shared<TrackList::Run>(a);
  joined->tracks.insert(joined->tracks.end(), b.tracks.begin(), b.tracks.end());
  joined->boxes.insert(joined->boxes.end(), b.boxes.begin(), b.boxes.end());
  joined->bounds.Extend(b.bounds);
  joined->bytes += b.bytes;
  return joined;
}

}  // namespace

TrackList::Position TrackList::PositionOf(size_t n) const {
  size_t run = 0;
  while (n >= runs_[run]->tracks.size()) n -= runs_[run++]->tracks.size();
  return {run, n};
}

void TrackList::ForEach(absl::FunctionRef<void(const TrackPtr&)> visit) const {
  for (const RunPtr& run : runs_) {
    for (const TrackPtr& track : run->tracks) visit(track);
  }
}

std::vector<TrackList::Position> TrackList::Intersecting(const Box& box) const {
  std::vector<Position> found;
  for (size_t r = 0; r < runs_.size(); ++r) {
    const Run& run = *runs_[r];
    if (!run.bounds.Intersects(box)) continue;
    for (size_t slot = 0; slot < run.boxes.size(); ++slot) {
      if (run.boxes[slot].Intersects(box)) found.push_back({r, slot});
    }
  }
  return found;
}

void TrackList::push_back(TrackPtr track) {
  ++size_;
  const bool opens = runs_.empty() || runs_.back()->tracks.size() >= kMostOfRun;
  auto run = opens ? std::make_shared<Run>() : std::make_shared<Run>(*runs_.back());
  Add(std::move(track), run.get());
  if (opens) {
    runs_.push_back(std::move(run));
  } else {
    runs_.back() = std::move(run);
  }
}

void TrackList::Replace(std::span<const Change> changes) {
  bool has_gaps = false;
  for (size_t next = 0; next < changes.size();) {
    const size_t number = changes[next].position.run;
    auto run = std::make_shared<Run>(*runs_[number]);
    for (; next < changes.size() && changes[next].position.run == number; ++next) {
      const auto& [position, track] = changes[next];
      TrackPtr& slot = run->tracks[position.slot];
      run->bytes += (track ? ByteSize(*track) : 0) - ByteSize(*slot);
      if (track) run->boxes[position.slot] = track->outline.bounds();
      if (!track) {
        --size_;
        has_gaps = true;
      }
      slot = track;
    }
    Tidy(run.get());
    runs_[number] = std::move(run);
  }
  if (!has_gaps) return;
  // Joins runs that have become small with the ones before them.
  std::vector<RunPtr> joined;
  for (RunPtr& run : runs_) {
    if (run->tracks.empty()) continue;
    if (!joined.empty() && joined.back()->tracks.size() + run->tracks.size() <= kMostOfRun / 2) {
      joined.back() = Joined(*joined.back(), *run);
    } else {
      joined.push_back(std::move(run));
    }
  }
  runs_ = std::move(joined);
}

int64_t TrackList::Bytes() const {
  auto bytes = static_cast<int64_t>(runs_.size() * (sizeof(RunPtr) + sizeof(Run)) +
                                    size_ * (sizeof(TrackPtr) + sizeof(Box)));
  for (const RunPtr& run : runs_) bytes += run->bytes;
  return bytes;
}

int64_t TrackList::BytesBesides(const TrackList& older) const {
  absl::flat_hash_set<const Track*> shared;
  older.ForEachBesides(*this, [&](const TrackPtr& track) { shared.insert(track.get()); });
  auto bytes = static_cast<int64_t>(runs_.size() * sizeof(RunPtr));
  ForEachBesides(older, [&](const TrackPtr& track) {
    bytes += static_cast<int64_t>(sizeof(TrackPtr) + sizeof(Box));
    if (!shared.contains(track.get())) bytes += ByteSize(*track);
  });
  return bytes;
}

void TrackList::ForEachBesides(const TrackList& other,
                               absl::FunctionRef<void(const TrackPtr&)> visit) const {
  absl::flat_hash_set<const Run*> shared;
  shared.reserve(other.runs_.size());
  for (const RunPtr& run : other.runs_) shared.insert(run.get());
  for (const RunPtr& run : runs_) {
    if (shared.contains(run.get())) continue;
    for (const TrackPtr& track : run->tracks) visit(track);
  }
}

}  // namespace hypermap::fusion
