// Comparisons with the store that a server makes by itself.
#ifndef HYPERMAP_SERVER_SESSION_COMPARISON_SCHEDULE_H_
#define HYPERMAP_SERVER_SESSION_COMPARISON_SCHEDULE_H_

#include <memory>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "server/session/comparison_meters.h"
#include "server/session/site.h"

namespace hypermap::server {

// Compares each open map with the store, one after another, on a thread of its own. The owner of a
// map and all servers that follow it are each compared with the store, and so with each other. A
// map that is shown otherwise than the store has it is an error in the log, is counted, and is
// loaded again: what is stored is the map. Thread safe.
class ComparisonSchedule {
 public:
  // The first comparisons begin after `every`. `site` must outlive this, and its store be shared.
  static absl::StatusOr<std::unique_ptr<ComparisonSchedule>> Start(Site* site,
                                                                   absl::Duration every);
  // Gives up the comparison under way.
  ~ComparisonSchedule();
  ComparisonSchedule(const ComparisonSchedule&) = delete;
  ComparisonSchedule& operator=(const ComparisonSchedule&) = delete;

  const ComparisonMeters& meters() const { return meters_; }

 private:
  ComparisonSchedule(Site* site, absl::Duration every) : site_(site), every_(every) {}

  void Run();
  // Waits for the next round; false if the schedule ends.
  bool AwaitRound();
  bool is_ending() const;
  void Compare(MapSession& session);

  Site* const site_;
  const absl::Duration every_;
  ComparisonMeters meters_;

  mutable Mutex mutex_;
  CondVar changed_;
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_COMPARISON_SCHEDULE_H_
