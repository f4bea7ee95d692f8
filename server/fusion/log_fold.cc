#include "server/fusion/log_fold.h"

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::server {

absl::StatusOr<FoldPoint> BeginningOfLog(const std::optional<storage::FusionBase>& base,
                                         const fusion::Strategy& strategy) {
  if (!base) return FoldPoint{storage::BeforeAll(), strategy.Initial()};
  absl::StatusOr<fusion::StatePtr> state = strategy.Decode(base->state);
  if (!state.ok()) {
    return absl::DataLossError(
        absl::StrCat("the state with which the log of evidence begins can't be read: ",
                     state.status().message()));
  }
  return FoldPoint{base->key, *std::move(state)};
}

LogFold::LogFold(std::shared_ptr<const fusion::Strategy> strategy, const FusionOptions* options,
                 int64_t max_checkpoint_bytes, std::shared_ptr<RememberedSteps> steps,
                 FoldWork* work)
    : strategy_(std::move(strategy)),
      options_(options),
      steps_(std::move(steps)),
      work_(work),
      tip_{storage::BeforeAll(), strategy_->Initial()},
      checkpoints_(strategy_, options->max_lateness, max_checkpoint_bytes) {}

void LogFold::RestartAt(FoldPoint point) {
  tip_ = std::move(point);
  const std::optional<FoldPoint> newest = checkpoints_.Newest();
  entries_since_checkpoint_ = newest ? tip_.position - newest->position : 0;
}

void LogFold::Advance(const storage::LogKey& key, fusion::StatePtr state, int64_t num_entries) {
  tip_ = {key, std::move(state), tip_.position + num_entries};
  entries_since_checkpoint_ += num_entries;
  if (entries_since_checkpoint_ >= options_->entries_per_checkpoint) AddCheckpoint();
}

void LogFold::AddCheckpoint() {
  entries_since_checkpoint_ = 0;
  checkpoints_.Add(tip_);
}

void LogFold::TakeOver(const LogFold& other) {
  const int64_t shift = checkpoints_.Append(other.checkpoints_);
  RestartAt({other.tip_.key, other.tip_.state, other.tip_.position + shift});
}

int64_t LogFold::Bytes() const {
  return strategy_->ByteSize(tip_.state, nullptr) + checkpoints_.Bytes(tip_.state);
}

void EntryFolder::Fold(const Evidence& evidence) {
  if (evidence.fact) {
    if (!facts_) facts_ = fold_->strategy().FoldFacts(fold_->tip().state);
    facts_->Add(*evidence.fact);
    last_fact_ = evidence.key;
    ++num_facts_;
    return;
  }
  Finish();
  fold_->Advance(evidence.key, evidence.observation ? Folded(evidence) : fold_->tip().state, 1);
}

fusion::StatePtr EntryFolder::Folded(const Evidence& evidence) {
  RememberedSteps& steps = fold_->steps();
  const fusion::FoldStepPtr known = steps.Find(evidence.key, *evidence.observation);
  fusion::FoldStepPtr step = known;
  fusion::StatePtr state =
      fold_->strategy().FoldAgain(fold_->tip().state, *evidence.observation, &step);
  const bool repeated = known && step == known;
  ++(repeated ? fold_->work().repeated : fold_->work().folded);
  if (known) steps.Count(repeated);
  if (!repeated) steps.Set(evidence.key, evidence.observation, std::move(step));
  return state;
}

void EntryFolder::Finish() {
  if (!facts_) return;
  fold_->Advance(last_fact_, facts_->Finish(), std::exchange(num_facts_, 0));
  facts_.reset();
}

}  // namespace hypermap::server
