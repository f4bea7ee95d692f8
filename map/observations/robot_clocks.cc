#include "map/observations/robot_clocks.h"

#include <algorithm>

namespace hypermap {

void ClockSkew::Add(absl::Time stamp, absl::Time arrival) {
  const absl::Duration age = arrival - window_begin_;
  // A negative age means that the measuring clock was set back: its earlier readings do not compare
  // with later ones.
  if (age >= 2 * kWindow || age < absl::ZeroDuration()) current_ = -absl::InfiniteDuration();
  if (age >= kWindow || age < absl::ZeroDuration()) {
    previous_ = current_;
    current_ = -absl::InfiniteDuration();
    window_begin_ = arrival;
  }
  current_ = std::max(current_, stamp - arrival);
}

absl::Duration ClockSkew::estimate() const {
  const absl::Duration largest = std::max(current_, previous_);
  return largest == -absl::InfiniteDuration() ? absl::ZeroDuration() : largest;
}

absl::Duration RobotClocks::Add(const std::string& robot, absl::Time stamp, absl::Time arrival) {
  const auto known = by_name_.find(robot);
  if (known != by_name_.end()) {
    entries_.splice(entries_.begin(), entries_, known->second);
  } else {
    entries_.push_front({robot, ClockSkew(), arrival});
    by_name_[robot] = entries_.begin();
  }
  Entry& entry = entries_.front();
  entry.skew.Add(stamp, arrival);
  entry.last_seen = arrival;
  const absl::Duration skew = entry.skew.estimate();
  if (entries_.size() > kMaxRobots) {
    by_name_.erase(entries_.back().name);
    entries_.pop_back();
  }
  return skew;
}

std::vector<RobotClocks::Robot> RobotClocks::List() const {
  std::vector<Robot> robots;
  robots.reserve(entries_.size());
  for (const Entry& entry : entries_) {
    robots.push_back({entry.name, entry.skew.estimate(), entry.last_seen});
  }
  return robots;
}

}  // namespace hypermap
