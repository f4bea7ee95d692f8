// The tracks of a state by key and by place.
#ifndef HYPERMAP_MAP_FUSION_TRACK_INDEX_H_
#define HYPERMAP_MAP_FUSION_TRACK_INDEX_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "map/fusion/strategy.h"
#include "map/objects/packed_rtree.h"

namespace hypermap::fusion {

// Finds the track that an operator's fact is about, while facts add and move tracks.
//
// The boxes are in static R-trees whose sizes at least double, and the newest few in a list
// (Bentley and Saxe, "Decomposable searching problems I: static-to-dynamic transformation", Journal
// of Algorithms 1980). n tracks that are added or moved cost O(n log^2 n) in total. Trees are built
// by the first search by place that needs them. Not thread safe.
class TrackIndex {
 public:
  // Makes room for this many tracks.
  void Reserve(size_t num_tracks) {
    by_key_.reserve(num_tracks);
    boxes_.reserve(num_tracks);
  }
  // Adds the next track; they are numbered from 0 on. An empty box intersects nothing.
  void Add(const TrackKey& key, const Box& box);
  // Gives a track another box.
  void Move(size_t track, const Box& box);

  // Returns the track with this key, the first one if there are several. Failing that, returns the
  // one with the greatest score of those whose boxes intersect `box`, the last one if there are
  // several; nullopt if all scores are below `least`. `score` gets the number of a track, perhaps
  // more than once. Returns any result when the work of this thread is cancelled.
  std::optional<size_t> Find(const TrackKey& key, const Box& box, double least,
                             absl::FunctionRef<double(size_t)> score);

 private:
  // Packs the tracks of recent_, together with the trees that are not larger.
  void Pack();

  absl::flat_hash_map<TrackKey, size_t> by_key_;
  std::vector<Box> boxes_;  // By track.
  // Tracks whose boxes may be in no tree, and the same as a flag for each track.
  std::vector<int32_t> recent_;
  std::vector<bool> is_recent_;
  // The oldest and largest first. May also contain former boxes of tracks that have moved.
  std::vector<PackedRTree> trees_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_TRACK_INDEX_H_
