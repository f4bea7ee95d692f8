#include "server/session/compaction.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/logging/log.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// Bounds the time of a step, for which edits wait.
constexpr int kRowsPerStep = 200;
constexpr absl::Duration kBetweenPasses = absl::Minutes(1);
// A pass also begins after history_revisions / kPassesPerHistory new revisions, so that a busy map
// exceeds its bound by little.
constexpr int64_t kPassesPerHistory = 10;

}  // namespace

Compaction::Compaction(std::string map, storage::StoredMap* stored, HistoryPool* history,
                       const MapTime* time, const Limits& limits)
    : map_(std::move(map)), stored_(stored), history_(history), time_(time), limits_(limits) {}

bool Compaction::IsDue(Revision newest) const {
  const int64_t slack = std::max<int64_t>(limits_.history_revisions / kPassesPerHistory, 1);
  return next() <= time_->Passed() || newest - revision_of_last_pass_ >= slack;
}

absl::Duration Compaction::next() const {
  return under_way_ ? -absl::InfiniteDuration() : next_pass_;
}

absl::StatusOr<Revision> Compaction::OldestToKeep(Revision newest) const {
  HYPERMAP_ASSIGN_OR_RETURN(HistoryPool::Lease reader, history_->TakeReserved());
  HYPERMAP_ASSIGN_OR_RETURN(const storage::KeptRevisions kept, reader->Kept());
  Revision oldest = std::max(kept.oldest, newest - limits_.history_revisions);
  if (limits_.history_age < absl::InfiniteDuration()) {
    const absl::StatusOr<Revision> by_age =
        reader->RevisionAt(time_->CommitTimeBefore(limits_.history_age));
    if (by_age.ok()) {
      oldest = std::max(oldest, *by_age);
    } else if (!absl::IsOutOfRange(by_age.status())) {  // OUT_OF_RANGE: all kept ones are younger
      return by_age.status();
    }
  }
  return std::min(oldest, newest);
}

absl::Status Compaction::ForgetEvidence(MapFusion* fusion) {
  if (limits_.observation_age == absl::InfiniteDuration()) return absl::OkStatus();
  const absl::Time before = time_->CommitTimeBefore(limits_.observation_age);
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<std::string> layers, fusion->ForgetEvidence(before));
  for (const std::string& layer : layers) {
    logging::Log(logging::Level::kInfo, "old evidence is no longer kept",
                 {{"map", map_}, {"layer", layer}, {"before", absl::FormatTime(before)}});
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> Compaction::StepOfPass(Revision newest, MapFusion* fusion) {
  if (!under_way_) {
    revision_of_last_pass_ = newest;
    HYPERMAP_ASSIGN_OR_RETURN(const Revision oldest, OldestToKeep(newest));
    oldest_ = oldest;
    receipts_before_ = time_->CommitTimeBefore(limits_.receipt_age) + absl::Nanoseconds(1);
    HYPERMAP_RETURN_IF_ERROR(ForgetEvidence(fusion));
  }
  return stored_->Compact(oldest_, receipts_before_, kRowsPerStep);
}

void Compaction::Step(Revision newest, MapFusion* fusion) {
  const absl::Duration now = time_->Passed();
  const absl::StatusOr<bool> more = StepOfPass(newest, fusion);
  if (!more.ok()) {
    logging::Log(logging::Level::kWarning, "history can't be compacted",
                 {{"map", map_}, {"problem", more.status().ToString()}});
  }
  under_way_ = more.ok() && *more;
  if (!under_way_) next_pass_ = now + kBetweenPasses;
}

}  // namespace hypermap::server
