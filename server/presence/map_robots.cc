#include "server/presence/map_robots.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::server {

// Holds the lock of the robots and brings them up to date. At its end, without the lock, it calls
// the callbacks of those who wait, if there was a change.
class ABSL_SCOPED_LOCKABLE MapRobots::Turn {
 public:
  explicit Turn(MapRobots* robots)
      ABSL_EXCLUSIVE_LOCK_FUNCTION(robots->mutex_) ABSL_NO_THREAD_SAFETY_ANALYSIS
      : robots_(*robots),
        now_(robots->clock_->Read()) {
    robots_.mutex_.lock();
    newest_before_ = robots_.newest_;
    robots_.PassTime(now_.since_boot);
  }
  ~Turn() ABSL_UNLOCK_FUNCTION() ABSL_NO_THREAD_SAFETY_ANALYSIS {
    std::map<WaitId, Callback> due;
    if (robots_.newest_ != newest_before_) due.swap(robots_.waiters_);
    robots_.mutex_.unlock();
    for (auto& [id, callback] : due) std::move(callback)();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  const ServerClock::Instant& now() const { return now_; }

 private:
  MapRobots& robots_;
  const ServerClock::Instant now_;
  ChangeNumber newest_before_;
};

MapRobots::MapRobots(const Limits& limits, ServerClock* clock)
    : max_robots_(limits.max_robots),
      online_for_(absl::Seconds(limits.robot_online_seconds)),
      remembered_for_(absl::Seconds(limits.robot_memory_seconds)),
      clock_(clock) {}

absl::StatusOr<bool> MapRobots::Report(RobotReport report) {
  const Turn turn(this);
  const auto known = robots_.find(report.robot);
  if (known == robots_.end()) {
    HYPERMAP_RETURN_IF_ERROR(MakeRoom());
  } else if (const RobotPresence& presence = known->second.presence;
             presence.online && report.stamp < presence.report.stamp) {
    return false;
  }
  Accept(std::move(report), turn.now());
  return true;
}

absl::Status MapRobots::MakeRoom() {
  if (robots_.size() < max_robots_) return absl::OkStatus();
  if (offline_.empty()) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "the map has ", robots_.size(), " robots online, --max_robots is ", max_robots_));
  }
  Forget(std::string(offline_.begin()->second));
  return absl::OkStatus();
}

void MapRobots::Accept(RobotReport report, const ServerClock::Instant& now) {
  const std::string name = report.robot;
  Robot& robot = robots_[name];
  (robot.presence.online ? online_ : offline_).erase({robot.seen, name});
  online_.insert({now.since_boot, name});
  robot.presence = {std::move(report), /*in_map_frame=*/false, /*online=*/true, now.now};
  robot.seen = now.since_boot;
  if (const auto gone = forgotten_.extract(name)) changes_.erase(gone.mapped());
  NoteChange(name, &robot.changed);
}

void MapRobots::PassTime(absl::Duration now) {
  while (!online_.empty() && online_.begin()->first + online_for_ <= now) {
    const auto late = online_.extract(online_.begin());
    Robot& robot = robots_.at(late.value().second);
    robot.presence.online = false;
    NoteChange(late.value().second, &robot.changed);
    offline_.insert(late.value());
  }
  while (!offline_.empty() && offline_.begin()->first + remembered_for_ <= now) {
    Forget(std::string(offline_.begin()->second));
  }
}

void MapRobots::NoteChange(const std::string& name, ChangeNumber* changed) {
  changes_.erase(*changed);
  *changed = ++newest_;
  changes_.emplace(newest_, name);
}

void MapRobots::Forget(const std::string& name) {
  const auto robot = robots_.find(name);
  offline_.erase({robot->second.seen, name});
  NoteChange(name, &robot->second.changed);
  forgotten_.emplace(name, robot->second.changed);
  robots_.erase(robot);
  if (forgotten_.size() <= max_robots_) return;
  const auto oldest =
      std::min_element(forgotten_.begin(), forgotten_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  lost_ = oldest->second;
  changes_.erase(lost_);
  forgotten_.erase(oldest);
}

std::vector<RobotPresence> MapRobots::List() {
  const Turn turn(this);
  std::vector<RobotPresence> robots;
  robots.reserve(robots_.size());
  for (const auto& [name, robot] : robots_) robots.push_back(robot.presence);
  return robots;
}

MapRobots::Changes MapRobots::ReadAfter(ChangeNumber after, int64_t max_items, int64_t max_bytes) {
  const Turn turn(this);
  Changes changes;
  changes.reset = after == 0 || after < lost_;
  changes.number = changes.reset ? 0 : after;
  int64_t bytes = 0;
  auto next = changes_.upper_bound(changes.number);
  for (int64_t items = 0; next != changes_.end() && items < max_items && bytes < max_bytes;
       ++items, ++next) {
    bytes += Tell(next->second, &changes);
    changes.number = next->first;
  }
  changes.more = next != changes_.end();
  if (!changes.more) changes.number = newest_;
  return changes;
}

int64_t MapRobots::Tell(const std::string& name, Changes* changes) const {
  const auto robot = robots_.find(name);
  if (robot == robots_.end()) {
    changes->forgotten.push_back(name);
    return static_cast<int64_t>(name.size());
  }
  changes->robots.push_back(robot->second.presence);
  return ByteSize(robot->second.presence.report);
}

absl::Duration MapRobots::UntilChange() {
  const Turn turn(this);
  absl::Duration due = absl::InfiniteDuration();
  if (!online_.empty()) due = online_.begin()->first + online_for_;
  if (!offline_.empty()) due = std::min(due, offline_.begin()->first + remembered_for_);
  return due - turn.now().since_boot;
}

MapRobots::WaitId MapRobots::Await(ChangeNumber after, Callback callback) {
  WaitId id = 0;
  {
    const MutexLock lock(&mutex_);
    id = next_wait_++;
    if (after >= newest_) {
      waiters_.emplace(id, std::move(callback));
      return id;
    }
  }
  std::move(callback)();
  return id;
}

void MapRobots::Remove(WaitId id) {
  // Destroyed after the lock is released: the callback may own objects that use this.
  std::map<WaitId, Callback>::node_type dropped;
  const MutexLock lock(&mutex_);
  dropped = waiters_.extract(id);
}

MapRobots::Count MapRobots::count() {
  const Turn turn(this);
  return {online_.size(), offline_.size()};
}

}  // namespace hypermap::server
