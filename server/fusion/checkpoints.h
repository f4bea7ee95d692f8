// The checkpoints of a fold: states at some entries of its log, from which it can go on.
#ifndef HYPERMAP_SERVER_FUSION_CHECKPOINTS_H_
#define HYPERMAP_SERVER_FUSION_CHECKPOINTS_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>

#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/fusion/strategy.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// The state of a fold after an entry of the log.
struct FoldPoint {
  storage::LogKey key;
  fusion::StatePtr state;
  // Entries that were folded until here, counted from where the fold began. Estimated for points
  // that come from several folds.
  int64_t position = 0;
};

// Chooses the checkpoint to drop, neither the first nor the last: the one without which the ratio
// of entries that are folded again to entries that must be is least above 1. Dropped by this rule,
// the checkpoints left are the denser the closer they are to `end`, so that an observation that is
// late by n entries costs little more than n. `positions` ascend, at most up to `end`. REQUIRES: at
// least three positions.
size_t MostDispensable(absl::Span<const int64_t> positions, int64_t end);

// Checkpoints in memory, ordered by key. Not thread safe.
class Checkpoints {
 public:
  // Without what they share with newer ones, all but the newest take at most `max_bytes`. Those
  // older than `max_age` are dropped, but for the newest of them.
  Checkpoints(std::shared_ptr<const fusion::Strategy> strategy, absl::Duration max_age,
              int64_t max_bytes);

  // Adds a checkpoint after all others; replaces the one with its key. May drop others.
  void Add(const FoldPoint& point);
  // Drops the checkpoints at and after the key.
  void DropFrom(const storage::LogKey& key);
  // Drops the checkpoints before the key.
  void DropBefore(const storage::LogKey& key);
  // Adds the checkpoints of another fold that come after the newest one here. Returns the number
  // that was added to their positions, so that positions ascend.
  int64_t Append(const Checkpoints& other);

  // The newest one, and the newest one before the key; nullopt if there is none.
  std::optional<FoldPoint> Newest() const;
  std::optional<FoldPoint> Before(const storage::LogKey& key) const;

  size_t size() const { return kept_.size(); }
  // Bytes of memory that they take besides `newer`, a state after all of them: an estimate.
  int64_t Bytes(const fusion::StatePtr& newer) const;

 private:
  struct Kept {
    fusion::StatePtr state;
    int64_t position = 0;
    int64_t unshared = 0;  // bytes of it that the next newer one does not share
  };
  using Map = std::map<storage::LogKey, Kept>;

  void CountUnshared(Map::iterator newer);
  // Drops checkpoints until all limits are kept.
  void Trim();

  std::shared_ptr<const fusion::Strategy> strategy_;
  absl::Duration max_age_;
  int64_t max_bytes_;
  Map kept_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_CHECKPOINTS_H_
