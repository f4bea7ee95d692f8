#include <thread>

#include "absl/synchronization/notification.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "tests/prove/proofs.h"

namespace hypermap::prove {
namespace {

// Cuts watches every second until its destruction.
class Cutter {
 public:
  explicit Cutter(WatcherGroup& watchers)
      : thread_([this, &watchers] {
          while (!done_.WaitForNotificationWithTimeout(absl::Seconds(1))) watchers.CutHalf();
        }) {}
  ~Cutter() { Stop(); }
  void Stop() {
    if (!done_.HasBeenNotified()) done_.Notify();
    if (thread_.joinable()) thread_.join();
  }

 private:
  absl::Notification done_;
  std::thread thread_;
};

}  // namespace

absl::StatusOr<Verdict> ProveFeed(Site& site, const Sizes& sizes) {
  HYPERMAP_RETURN_IF_ERROR(site.Start());
  WatcherGroup watchers(site, sizes.watchers, sizes.seed);
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntilBegun());
  const absl::Time begin = absl::Now();
  {
    Cutter cutter(watchers);
    WriterGroup writers(site, sizes.writers, {.edits = sizes.edits}, sizes.seed);
    HYPERMAP_RETURN_IF_ERROR(writers.Wait());
  }
  const double seconds = absl::ToDoubleSeconds(absl::Now() - begin);
  Model& model = site.model();
  HYPERMAP_RETURN_IF_ERROR(watchers.WaitUntil(model.newest()));

  const int64_t unaccounted = model.Sort();
  Faults faults;
  int64_t told = 0, resumed = 0, differ_from_model = 0, differ_from_query = 0;
  client::Client client = site.NewClient();
  for (const auto& follower : watchers.followers()) {
    faults += follower->Check(model);
    told += follower->num_told();
    resumed += follower->num_resumed();
    differ_from_model += !(follower->state() == model.At(model.newest(), follower->selection()));
    const absl::StatusOr<State> now = AskState(client, follower->selection());
    HYPERMAP_RETURN_IF_ERROR(now.status());
    differ_from_query += !(follower->state() == *now);
  }
  const bool holds = faults.none() && unaccounted == 0 && differ_from_model == 0 &&
                     differ_from_query == 0 && told > 0;
  return Verdict{{"proof", "feed"},
                 {"seed", sizes.seed},
                 {"writers", sizes.writers},
                 {"edits", model.num_edits()},
                 {"revisions", model.newest()},
                 {"seconds", seconds},
                 {"watchers", sizes.watchers},
                 {"resumed", resumed},
                 {"revisions_told", told},
                 {"gaps", faults.gaps},
                 {"repeats", faults.repeats},
                 {"reorders", faults.reorders},
                 {"wrong", faults.wrong},
                 {"unaccounted_revisions", unaccounted},
                 {"states_differ_from_model", differ_from_model},
                 {"states_differ_from_query", differ_from_query},
                 {"holds", holds}};
}

}  // namespace hypermap::prove
