// Time and the order of all that happens in a simulated history.
#ifndef HYPERMAP_TESTS_HISTORIES_SCHEDULE_H_
#define HYPERMAP_TESTS_HISTORIES_SCHEDULE_H_

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "base/sync/steady_time.h"
#include "base/time/clock.h"

namespace hypermap::histories {

// Runs events one at a time on the caller's thread. Of those that are due it picks one at random;
// if none is, time jumps to the next. All random choices of a history come from here, so that its
// seed repeats it.
class Schedule : public Clock, public Executor {
 public:
  // With `traces`, Trace writes its lines to stderr.
  explicit Schedule(uint64_t seed, bool traces = false);

  using Event = absl::AnyInvocable<void() &&>;
  // Runs `event` when `delay` has passed, or later.
  void After(absl::Duration delay, Event event);
  // Runs one event. Returns false if there is none.
  bool RunNext();
  int64_t num_run() const { return num_run_; }

  absl::Duration now() const { return now_; }

  bool Chance(double probability);
  int64_t Pick(int64_t low, int64_t high);  // both ends included
  absl::Duration Pick(absl::Duration low, absl::Duration high);

  // Notes what happens, for people who read the history of a failing seed.
  template <typename... Parts>
  void Trace(const Parts&... parts) const {
    if (traces_) WriteTrace(absl::StrCat(parts...));
  }

  // Clock. The wall clock is right.
  absl::Time Wall() const override;
  absl::Duration SinceBoot() const override;
  const std::string& BootId() const override { return boot_id_; }

  // Executor: steps of loops are events.
  SteadyTime Now() const override { return steady_begin_ + now_; }
  absl::StatusOr<std::unique_ptr<Running>> Start(ThreadName name, Step step) override;

 private:
  void WriteTrace(const std::string& line) const;

  struct Pending {
    absl::Duration due;
    Event event;
  };

  std::mt19937_64 rng_;
  const bool traces_;
  absl::Duration now_;
  int64_t num_run_ = 0;
  std::vector<Pending> pending_;
  const SteadyTime steady_begin_ = SteadyTime::Now();
  const std::string boot_id_ = "boot 1";
};

}  // namespace hypermap::histories

#endif  // HYPERMAP_TESTS_HISTORIES_SCHEDULE_H_
