// The tracks of a state of the evidence strategy.
#ifndef HYPERMAP_MAP_FUSION_TRACK_LIST_H_
#define HYPERMAP_MAP_FUSION_TRACK_LIST_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/fusion/track.h"
#include "map/geometry/point.h"

namespace hypermap::fusion {

// Tracks in the order in which they were founded. A value: copies share runs of up to kMostOfRun
// tracks, so that a copy with a few changed tracks costs little, and so does the difference of two
// copies. The outlines of tracks must not change while they are in a list.
class TrackList {
 public:
  static constexpr size_t kMostOfRun = 64;

  // Consecutive tracks.
  struct Run {
    std::vector<TrackPtr> tracks;
    std::vector<Box> boxes;  // of the outline of each; may be empty
    Box bounds;              // of the boxes
    int64_t bytes = 0;       // ByteSize of the tracks
  };
  using RunPtr = std::shared_ptr<const Run>;

  // Where a track is. Positions are ordered as the tracks are, and valid until a change.
  struct Position {
    size_t run = 0;
    size_t slot = 0;
    friend auto operator<=>(const Position&, const Position&) = default;
  };
  struct Change {
    Position position;
    TrackPtr track;  // null: removes the one that is there
  };

  size_t size() const { return size_; }
  const TrackPtr& At(const Position& position) const {
    return runs_[position.run]->tracks[position.slot];
  }
  // The n-th track. Costs a step for each run.
  const TrackPtr& operator[](size_t n) const { return At(PositionOf(n)); }
  void ForEach(absl::FunctionRef<void(const TrackPtr&)> visit) const;
  // The positions of the tracks whose outlines have bounds that intersect the box, in order.
  std::vector<Position> Intersecting(const Box& box) const;

  void push_back(TrackPtr track);
  // Replaces the n-th track.
  void Set(size_t n, TrackPtr track) {
    Replace(std::vector<Change>{{PositionOf(n), std::move(track)}});
  }
  // Carries out changes, which must be in the order of their positions.
  void Replace(std::span<const Change> changes);

  // ByteSize of all tracks, or of those that `older` does not share. Costs a step for each run, and
  // one for each track of the runs that differ.
  int64_t Bytes() const;
  int64_t BytesBesides(const TrackList& older) const;
  // Calls `visit` with each track of this list that may not be in `other`: those of runs that the
  // two do not share.
  void ForEachBesides(const TrackList& other, absl::FunctionRef<void(const TrackPtr&)> visit) const;

 private:
  Position PositionOf(size_t n) const;

  std::vector<RunPtr> runs_;  // none is empty
  size_t size_ = 0;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_TRACK_LIST_H_
