#include "base/time/server_clock.h"

#include <algorithm>
#include <cstdint>

#include "base/logging/log.h"

namespace hypermap {
namespace {

// A jump whose size changes by more than this is another one. What changes less, such as a wall
// clock that stands still, is logged no more often than the wall clock loses this.
constexpr absl::Duration kLoggedChange = absl::Hours(1);
// A reading that took longer tells nothing: the process was stopped between the two clocks.
constexpr absl::Duration kMaxReading = absl::Milliseconds(100);
// The first reading, by which the clock is set, is repeated until one was as quick as this.
constexpr absl::Duration kQuickReading = absl::Microseconds(20);
constexpr int kFirstReadings = 10;

std::string Text(absl::Duration duration) { return absl::FormatDuration(duration); }

}  // namespace

ServerClock::ServerClock(const Clock* clock) : clock_(clock) {
  Reading reading = ReadClocks();
  for (int i = 1; i < kFirstReadings && reading.took > kQuickReading; ++i) {
    const Reading next = ReadClocks();
    if (next.took < reading.took) reading = next;
  }
  now_at_boot_ = reading.wall_at_boot();
  updated_ = reading.since_boot;
  settled_since_ = reading.since_boot;
}

ServerClock::Reading ServerClock::ReadClocks() const {
  const absl::Duration before = clock_->SinceBoot();
  const absl::Time wall = clock_->Wall();
  const absl::Duration after = clock_->SinceBoot();
  return {wall, after, after - before};
}

absl::Duration ServerClock::Reading::WallMinus(absl::Time other_at_boot) const {
  const absl::Duration least = wall_at_boot() - other_at_boot;
  return std::max(least, std::min(least + took, absl::ZeroDuration()));
}

ServerClock::Instant ServerClock::Read() {
  const Reading reading = ReadClocks();
  const MutexLock lock(&mutex_);
  Update(reading);
  // Files and messages keep whole nanoseconds, but slewing goes in smaller steps.
  const int64_t now_ns = absl::ToUnixNanos(now_at_boot_ + reading.since_boot);
  return {absl::FromUnixNanos(now_ns), reading.since_boot};
}

void ServerClock::Update(const Reading& reading) {
  // Another thread may have read later and come first.
  if (reading.since_boot < updated_ || reading.took > kMaxReading) return;
  const absl::Duration passed = reading.since_boot - updated_;
  updated_ = reading.since_boot;
  const absl::Duration error = reading.WallMinus(now_at_boot_);
  if (absl::AbsDuration(error) <= kInStep) {
    if (pending_) EndJump(reading);
    Slew(error, passed);
    return;
  }
  settled_since_ = reading.since_boot;
  NoteJump(reading, error);
  if (reading.since_boot - pending_->since < kSettle) return;
  logging::Log(logging::Level::kWarning, "clock goes where the wall clock has been since its jump",
               {{"step", Text(error)}, {"after", Text(reading.since_boot - pending_->noticed)}});
  now_at_boot_ = reading.wall_at_boot();
  settled_since_ = pending_->since;
  ++num_followed_;
  pending_.reset();
}

void ServerClock::Slew(absl::Duration error, absl::Duration passed) {
  const absl::Duration most = passed * kSlew;
  now_at_boot_ += std::clamp(error, -most, most);
}

void ServerClock::EndJump(const Reading& reading) {
  logging::Log(logging::Level::kWarning, "wall clock is back after a jump",
               {{"size", Text(pending_->logged_size)},
                {"lasted", Text(reading.since_boot - pending_->noticed)}});
  pending_.reset();
}

void ServerClock::NoteJump(const Reading& reading, absl::Duration size) {
  const bool is_new = !pending_;
  if (is_new) {
    pending_ = Pending{reading.wall_at_boot(), reading.since_boot, reading.since_boot, size};
  } else if (absl::AbsDuration(reading.wall_at_boot() - pending_->wall_at_boot) > kInStep) {
    pending_->wall_at_boot = reading.wall_at_boot();
    pending_->since = reading.since_boot;
  }
  if (!is_new && absl::AbsDuration(size - pending_->logged_size) < kLoggedChange) return;
  pending_->logged_size = size;
  ++num_jumps_;
  logging::Log(logging::Level::kWarning, "wall clock has jumped and is not believed yet",
               {{"size", Text(size)}, {"believed_after", Text(kSettle)}});
}

void ServerClock::Resume(const std::string& boot_id, absl::Duration since_boot, absl::Time now) {
  if (boot_id != clock_->BootId() || since_boot > clock_->SinceBoot()) return;
  const Reading reading = ReadClocks();
  const MutexLock lock(&mutex_);
  if (since_boot <= resumed_) return;
  resumed_ = since_boot;
  if (absl::AbsDuration(now - since_boot - now_at_boot_) <= kInStep) return;
  now_at_boot_ = now - since_boot;
  pending_.reset();
  Update(reading);
}

bool ServerClock::IsSettled() {
  const Reading reading = ReadClocks();
  const MutexLock lock(&mutex_);
  Update(reading);
  return !pending_ && updated_ - settled_since_ >= kSettle;
}

ServerClock::State ServerClock::state() {
  const Reading reading = ReadClocks();
  const MutexLock lock(&mutex_);
  Update(reading);
  State state;
  if (pending_) {
    state.jump = Jump{reading.wall_at_boot() - now_at_boot_, updated_ - pending_->noticed};
  }
  state.num_jumps = num_jumps_;
  state.num_followed = num_followed_;
  return state;
}

}  // namespace hypermap
