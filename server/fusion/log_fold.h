// The fold of a fused layer's log up to an entry, with checkpoints on the way.
#ifndef HYPERMAP_SERVER_FUSION_LOG_FOLD_H_
#define HYPERMAP_SERVER_FUSION_LOG_FOLD_H_

#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "map/fusion/strategy.h"
#include "server/fusion/checkpoints.h"
#include "server/fusion/evidence.h"
#include "server/fusion/fold_work.h"
#include "server/fusion/fusion_options.h"
#include "server/fusion/remembered_steps.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// The point where the fold of a log begins: at its base, or without evidence if it has none.
// DATA_LOSS if the state of the base can't be read.
absl::StatusOr<FoldPoint> BeginningOfLog(const std::optional<storage::FusionBase>& base,
                                         const fusion::Strategy& strategy);

// A value: copies share their states. Not thread safe.
class LogFold {
 public:
  // The fold of no entry. `steps` are those of the strategy, also of other folds. Counts what it
  // folds in `work`. `options` and `work` must outlive this and its copies.
  LogFold(std::shared_ptr<const fusion::Strategy> strategy, const FusionOptions* options,
          int64_t max_checkpoint_bytes, std::shared_ptr<RememberedSteps> steps, FoldWork* work);

  // The state after the last entry that was folded.
  const FoldPoint& tip() const { return tip_; }
  const Checkpoints& checkpoints() const { return checkpoints_; }
  const fusion::Strategy& strategy() const { return *strategy_; }
  FoldWork& work() { return *work_; }
  RememberedSteps& steps() { return *steps_; }

  // Goes on from another point. REQUIRES: no checkpoint is after it.
  void RestartAt(FoldPoint point);
  // Makes `state` the tip: that after the entry `key`, the last one of `num_entries` after the tip.
  void Advance(const storage::LogKey& key, fusion::StatePtr state, int64_t num_entries);
  // Keeps the tip as a checkpoint.
  void AddCheckpoint();
  // Drops the checkpoints at and after the key, because the log has changed there.
  void DropFrom(const storage::LogKey& key) { checkpoints_.DropFrom(key); }
  // Drops the checkpoints before the key, because the log has forgotten the entries up to it.
  void DropBefore(const storage::LogKey& key) { checkpoints_.DropBefore(key); }
  // Goes on from the tip of `other`, and takes over its checkpoints that come after those here,
  // which must be of the same entries.
  void TakeOver(const LogFold& other);

  // Bytes of memory that the tip and the checkpoints take: an estimate.
  int64_t Bytes() const;

 private:
  std::shared_ptr<const fusion::Strategy> strategy_;
  const FusionOptions* options_;
  std::shared_ptr<RememberedSteps> steps_;
  FoldWork* work_;
  FoldPoint tip_;
  Checkpoints checkpoints_;
  int64_t entries_since_checkpoint_ = 0;
};

// Folds entries of a log onto a LogFold, one after another. The facts between two observations
// become one state: states between them would only serve late observations that come between two
// facts.
class EntryFolder {
 public:
  explicit EntryFolder(LogFold* fold) : fold_(fold) {}

  void Fold(const Evidence& evidence);
  // Must be called after the last entry.
  void Finish();

 private:
  // The state after an observation.
  fusion::StatePtr Folded(const Evidence& evidence);

  LogFold* const fold_;
  std::unique_ptr<fusion::FactFold> facts_;  // since the last observation
  storage::LogKey last_fact_;
  int64_t num_facts_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_LOG_FOLD_H_
