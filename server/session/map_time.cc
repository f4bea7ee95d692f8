#include "server/session/map_time.h"

#include <algorithm>
#include <utility>

namespace hypermap::server {
namespace {

// Change of the distance between commit times and the time that passed for which a new mark is
// made. While commit times stand still, the distance changes all the time.
constexpr absl::Duration kTolerance = absl::Seconds(1);
constexpr absl::Duration kToleranceWhenAhead = absl::Seconds(10);
// Step of commit times that are ahead of the clock.
constexpr absl::Duration kStepWhenAhead = absl::Microseconds(1);

absl::Duration SinceEpoch(absl::Time time) { return time - absl::UnixEpoch(); }

absl::Duration CommitMinusPassed(const storage::TimeMark& mark) {
  return SinceEpoch(mark.commit_time) - mark.passed;
}
absl::Duration CommitMinusLived(const storage::TimeMark& mark) {
  return SinceEpoch(mark.commit_time) - mark.lived;
}

// Returns whether commit times were ahead of the clock at the mark, and so stood still before it.
bool IsAhead(const storage::TimeMark& mark) { return mark.commit_time > mark.server_time; }

// The latest time of a commit before the mark. A commit right after it may have its time, unless
// that is of an older commit or ahead of the clock.
absl::Time LastBefore(const storage::TimeMark& mark) {
  return mark.commit_time == mark.server_time ? mark.commit_time - absl::Nanoseconds(1)
                                              : mark.commit_time;
}

}  // namespace

MapTime::MapTime(std::shared_ptr<ServerClock> clock, std::vector<storage::TimeMark> marks,
                 absl::Time newest_commit)
    : clock_(std::move(clock)), last_commit_(newest_commit), marks_(std::move(marks)) {
  const MutexLock lock(&mutex_);
  const storage::TimeMark* const last = marks_.empty() ? nullptr : &marks_.back();
  if (last != nullptr) last_commit_ = std::max(last_commit_, last->commit_time);
  if (last == nullptr || last->boot_id != clock_->BootId() ||
      last->since_boot > clock_->SinceBoot()) {
    ResumeAfterBoot(last, newest_commit);
    return;
  }
  clock_->Resume(last->boot_id, last->since_boot, last->server_time);
  passed_at_boot_ = last->passed - last->since_boot;
  off_ = last->lived - last->passed;
}

void MapTime::ResumeAfterBoot(const storage::TimeMark* last, absl::Time newest_commit) {
  const ServerClock::Instant at = clock_->Read();
  absl::Duration passed = SinceEpoch(newest_commit);
  TimeOff off{newest_commit, passed};
  if (last != nullptr) {
    // The map went on after its newest mark, at least until its newest commit.
    const absl::Duration after = std::max(newest_commit - last->commit_time, absl::ZeroDuration());
    passed = last->passed + after;
    off_ = last->lived - last->passed;
    off = {last->server_time + after, passed};
  }
  passed_at_boot_ = passed - at.since_boot;
  const absl::Duration length = at.now - off.since;
  if (length >= absl::ZeroDuration() && length <= kTrustedOff) {
    off_ += length;
  } else {
    unknown_off_ = off;
  }
}

void MapTime::ReadClocks() {
  const bool is_settled = clock_->IsSettled();
  const ServerClock::Instant at = clock_->Read();
  const MutexLock lock(&mutex_);
  if (!unknown_off_ || !is_settled) return;
  const absl::Duration after = PassedAt(at.since_boot) - unknown_off_->passed;
  const absl::Duration length = at.now - unknown_off_->since - after;
  off_ += std::max(length, absl::ZeroDuration());
  unknown_off_.reset();
}

absl::Time MapTime::Now() const {
  const absl::Time now = clock_->Now();
  const MutexLock lock(&mutex_);
  return std::max(now, last_commit_);
}

absl::Duration MapTime::Passed() const { return PassedAt(clock_->SinceBoot()); }

absl::Duration MapTime::Lived() const {
  const absl::Duration since_boot = clock_->SinceBoot();
  const MutexLock lock(&mutex_);
  return LivedAt(since_boot);
}

absl::Duration MapTime::EndOf(const SemanticObject& object) const {
  if (!object.expires_at) return absl::InfiniteDuration();
  const MutexLock lock(&mutex_);
  // The first mark that the object's commit comes before.
  const auto after =
      std::lower_bound(marks_.begin(), marks_.end(), object.version,
                       [](const auto& mark, int64_t version) { return mark.revision < version; });
  const absl::Duration end = SinceEpoch(*object.expires_at);
  return after == marks_.begin() ? end : end - CommitMinusLived(*std::prev(after));
}

absl::Time MapTime::CommitTimeBefore(absl::Duration age) const {
  const ServerClock::Instant at = clock_->Read();
  const MutexLock lock(&mutex_);
  const auto mark_after = [&](absl::Duration time) {
    mutex_.AssertHeld();
    return std::upper_bound(marks_.begin(), marks_.end(), time,
                            [](absl::Duration t, const auto& mark) { return t < mark.passed; });
  };
  absl::Duration time = PassedAt(at.since_boot) - age;
  auto next = mark_after(time);
  const bool stood_still =
      next != marks_.begin() && (next == marks_.end() ? at.now < last_commit_ : IsAhead(*next));
  if (stood_still) {
    // While commit times stand still, commits may be younger than their mark says, by up to the
    // tolerance. Subtracting it keeps history rather too long than too short.
    time -= kToleranceWhenAhead;
    next = mark_after(time);
  }
  absl::Time commit_time = absl::UnixEpoch() + time;
  if (next != marks_.begin()) {
    const storage::TimeMark& mark = *std::prev(next);
    commit_time = mark.commit_time + (time - mark.passed);
  }
  if (next != marks_.end()) commit_time = std::min(commit_time, LastBefore(*next));
  return commit_time;
}

absl::Time MapTime::NextCommit() {
  const absl::Time now = clock_->Now();
  const MutexLock lock(&mutex_);
  last_commit_ = now >= last_commit_ ? now : last_commit_ + kStepWhenAhead;
  return last_commit_;
}

storage::TimeMark MapTime::MakeMark(Revision newest, absl::Time commit_time,
                                    const ServerClock::Instant& at) {
  return {newest,           commit_time,  PassedAt(at.since_boot), LivedAt(at.since_boot), at.now,
          clock_->BootId(), at.since_boot};
}

storage::TimeMark MapTime::Add(storage::TimeMark mark) {
  const bool replaces_lost =
      mark_is_lost_ && !marks_.empty() && marks_.back().revision == mark.revision;
  if (replaces_lost) marks_.pop_back();
  mark_is_lost_ = false;
  marks_.push_back(mark);
  return mark;
}

std::optional<storage::TimeMark> MapTime::MarkBeforeCommit(Revision newest) {
  const ServerClock::Instant at = clock_->Read();
  const MutexLock lock(&mutex_);
  storage::TimeMark mark = MakeMark(newest, std::max(at.now, last_commit_), at);
  if (!mark_is_lost_ && !marks_.empty() && marks_.back().boot_id == mark.boot_id) {
    const absl::Duration tolerance = at.now < last_commit_ ? kToleranceWhenAhead : kTolerance;
    const auto differs = [&](absl::Duration a, absl::Duration b) {
      return absl::AbsDuration(a - b) > tolerance;
    };
    const storage::TimeMark& last = marks_.back();
    if (!differs(CommitMinusPassed(mark), CommitMinusPassed(last)) &&
        !differs(CommitMinusLived(mark), CommitMinusLived(last))) {
      return std::nullopt;
    }
  }
  // The commit must not come before the mark that holds for it.
  last_commit_ = mark.commit_time;
  return Add(std::move(mark));
}

std::optional<storage::TimeMark> MapTime::MarkForRestart(Revision newest, bool closing) {
  const ServerClock::Instant at = clock_->Read();
  const MutexLock lock(&mutex_);
  const bool is_young = !marks_.empty() && !mark_is_lost_ &&
                        marks_.back().boot_id == clock_->BootId() &&
                        PassedAt(at.since_boot) - marks_.back().passed < kMarkInterval;
  // The newest mark tells a later process of this boot everything.
  if (is_young && !closing) return std::nullopt;
  // With the newest commit's time, because the clock may go back before the next one. It need not
  // hold for that, which then gets a mark of its own.
  return Add(MakeMark(newest, last_commit_, at));
}

void MapTime::MarkIsLost() {
  const MutexLock lock(&mutex_);
  mark_is_lost_ = true;
}

void MapTime::MarkIsStored(absl::Duration forget_before) {
  const MutexLock lock(&mutex_);
  auto first = marks_.begin();
  while (std::next(first) != marks_.end() && std::next(first)->passed < forget_before) ++first;
  marks_.erase(marks_.begin(), first);
}

}  // namespace hypermap::server
