// The time that a server goes by: near the wall clock, but not shaken by it.
#ifndef HYPERMAP_BASE_TIME_SERVER_CLOCK_H_
#define HYPERMAP_BASE_TIME_SERVER_CLOCK_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/time/clock.h"

namespace hypermap {

// Counts the time that passed since a point at which the wall clock was believed.
//
// Now() is a time of the wall clock plus the time that the boot clock counted since. While the wall
// clock is within kInStep of it, it is drawn towards the wall clock by at most kSlew of the time
// that passes. If the wall clock is farther away, it has jumped: somebody set it, or it is broken.
// A jump is not followed before the wall clock has kept to it for kSettle; then Now() steps to the
// wall clock at once, forwards or backwards. A wall clock that stands still or runs at another
// speed never keeps to anything, and is never followed.
//
// Intervals are measured with SinceBoot(), which no jump affects. Thread safe.
class ServerClock {
 public:
  static constexpr absl::Duration kInStep = absl::Seconds(1);
  static constexpr double kSlew = 0.01;
  static constexpr absl::Duration kSettle = absl::Minutes(10);

  // Believes the wall clock as it is now. `clock` must outlive this.
  explicit ServerClock(const Clock* clock = &SystemClock());

  absl::Time Now() { return Read().now; }
  // Now() and SinceBoot() of the same moment.
  struct Instant {
    absl::Time now;
    absl::Duration since_boot;
  };
  Instant Read();
  absl::Duration SinceBoot() const { return clock_->SinceBoot(); }
  const std::string& BootId() const { return clock_->BootId(); }

  // Makes Now() go on from what a server of this boot told: `now` at `since_boot`. Of several calls
  // the one with the newest reading counts. So a server that is started while the wall clock is
  // wrong does not believe it. Does nothing for a reading of another boot.
  void Resume(const std::string& boot_id, absl::Duration since_boot, absl::Time now);

  // Returns whether the wall clock has been in step for kSettle, so that Now() is probably right.
  bool IsSettled();

  // A jump of the wall clock that was not followed yet.
  struct Jump {
    absl::Duration size;  // what the wall clock is ahead of Now(); negative if it is behind
    absl::Duration age;   // since it was noticed
  };
  struct State {
    std::optional<Jump> jump;
    int64_t num_jumps = 0;     // that were noticed since the start
    int64_t num_followed = 0;  // of them
  };
  // For health and metrics. Jumps are also logged, once each, with their sizes.
  State state();

 private:
  // A reading of both clocks, within `took` of the boot clock.
  struct Reading {
    absl::Time wall;
    absl::Duration since_boot;
    absl::Duration took;

    // The wall clock's reading at the boot, as long as nobody sets it.
    absl::Time wall_at_boot() const { return wall - since_boot; }
    // The least that the wall clock can differ from a clock that read `other_at_boot` at the boot:
    // the time at which it was read is known to `took`.
    absl::Duration WallMinus(absl::Time other_at_boot) const;
  };
  struct Pending {
    absl::Time wall_at_boot;
    absl::Duration since;        // SinceBoot() at which the wall clock began to keep to it
    absl::Duration noticed;      // SinceBoot() at which the wall clock left Now()
    absl::Duration logged_size;  // size of the jump in the newest log line
  };

  Reading ReadClocks() const;
  void Update(const Reading& reading) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Slew(absl::Duration error, absl::Duration passed) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void EndJump(const Reading& reading) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void NoteJump(const Reading& reading, absl::Duration size) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Clock* const clock_;
  Mutex mutex_;
  absl::Time now_at_boot_ ABSL_GUARDED_BY(mutex_);  // Now() - SinceBoot()
  absl::Duration updated_ ABSL_GUARDED_BY(mutex_);
  absl::Duration settled_since_ ABSL_GUARDED_BY(mutex_);
  absl::Duration resumed_ ABSL_GUARDED_BY(mutex_) = -absl::InfiniteDuration();
  std::optional<Pending> pending_ ABSL_GUARDED_BY(mutex_);
  int64_t num_jumps_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_followed_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_TIME_SERVER_CLOCK_H_
