// Estimates of how far the clocks of robots are from the server's.
#ifndef HYPERMAP_MAP_OBSERVATIONS_ROBOT_CLOCKS_H_
#define HYPERMAP_MAP_OBSERVATIONS_ROBOT_CLOCKS_H_

#include <cstddef>
#include <list>
#include <string>
#include <unordered_map>
#include <vector>

#include "absl/time/time.h"

namespace hypermap {

// The skew of one clock, from messages that carry their time by that clock.
//
// A message that is stamped t by a clock with skew s arrives at t - s + delay, and its delay is
// never negative. So the largest of (stamp - arrival) over a while is the best estimate of s that
// messages in one direction give; it is too small by the shortest delay among them. Messages that
// were kept back for hours, such as those of an outbox, do not affect it. Not thread safe.
class ClockSkew {
 public:
  // Messages count for at least kWindow and at most twice as long.
  static constexpr absl::Duration kWindow = absl::Minutes(5);

  // REQUIRES: both times are finite.
  void Add(absl::Time stamp, absl::Time arrival);

  // Time by which the clock is ahead of the one that measured the arrivals; negative if it is
  // behind. Zero without messages.
  absl::Duration estimate() const;

 private:
  absl::Time window_begin_ = absl::InfinitePast();
  absl::Duration current_ = -absl::InfiniteDuration();   // largest since window_begin_
  absl::Duration previous_ = -absl::InfiniteDuration();  // largest in the window before
};

// The clocks of the robots that sent observations to a map, by the robots' names. Keeps the
// kMaxRobots that sent last. Not thread safe.
class RobotClocks {
 public:
  static constexpr size_t kMaxRobots = 1'024;

  struct Robot {
    std::string name;
    absl::Duration skew;   // as ClockSkew::estimate
    absl::Time last_seen;  // arrival of its newest message
  };

  // Adds a message, and returns the estimate of the robot's skew.
  absl::Duration Add(const std::string& robot, absl::Time stamp, absl::Time arrival);

  // The robots, the one that sent last first.
  std::vector<Robot> List() const;

 private:
  struct Entry {
    std::string name;
    ClockSkew skew;
    absl::Time last_seen;
  };

  std::list<Entry> entries_;  // the one that sent last first
  std::unordered_map<std::string, std::list<Entry>::iterator> by_name_;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_ROBOT_CLOCKS_H_
