#include "server/session/comparison_schedule.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "base/cancellation/cancellation.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/start_thread.h"

namespace hypermap::server {

absl::StatusOr<std::unique_ptr<ComparisonSchedule>> ComparisonSchedule::Start(
    Site* site, absl::Duration every) {
  std::unique_ptr<ComparisonSchedule> schedule(new ComparisonSchedule(site, every));
  HYPERMAP_ASSIGN_OR_RETURN(
      schedule->thread_,
      StartThread("hm-comparisons", [schedule = schedule.get()] { schedule->Run(); }));
  return schedule;
}

ComparisonSchedule::~ComparisonSchedule() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    ending_ = true;
  }
  changed_.NotifyAll();
  thread_.join();
}

bool ComparisonSchedule::is_ending() const {
  const MutexLock lock(&mutex_);
  return ending_;
}

bool ComparisonSchedule::AwaitRound() {
  const Deadline round(every_);
  const MutexLock lock(&mutex_);
  while (!ending_ && !round.has_passed()) changed_.WaitFor(&mutex_, round.left());
  return !ending_;
}

void ComparisonSchedule::Run() {
  Cancellation cancellation([this]() -> absl::Status {
    return is_ending() ? absl::CancelledError("the server stops") : absl::OkStatus();
  });
  const ScopedCancellation here(&cancellation);
  while (AwaitRound()) {
    for (const Site::Entry& entry : site_->List()) {
      if (is_ending()) return;
      if (entry.session) Compare(*entry.session);
    }
  }
}

void ComparisonSchedule::Compare(MapSession& session) {
  const std::string& map = session.header().name;
  const absl::StatusOr<StoreComparison> compared = site_->CompareWithStore(session);
  // A map that was closed meanwhile has nothing to compare.
  if (is_ending() || !session.problem().ok()) return;
  if (!compared.ok()) {
    meters_.AddFailed(map);
    return logging::Log(logging::Level::kWarning, "a map is not compared with the store",
                        {{"map", map}, {"problem", compared.status().ToString()}});
  }
  if (compared->differing.empty()) return meters_.AddEqual(map);
  meters_.AddDifferent(map);
  logging::Log(logging::Level::kError, "what is shown of a map differs from the store",
               {{"map", map},
                {"revision", absl::StrCat(compared->revision)},
                {"layers", absl::StrJoin(compared->differing, " ")}});
  site_->LoadAgain(map, session.incarnation()).IgnoreError();  // ABORTED: another call changes it
}

}  // namespace hypermap::server
