// A robot that explores: it asks for a goal, drives there, looks round, and asks again.
#ifndef HYPERMAP_SIMULATION_ROBOTS_ROBOT_H_
#define HYPERMAP_SIMULATION_ROBOTS_ROBOT_H_

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client_libs/cpp/client.h"
#include "map/frames/planar_transform.h"
#include "simulation/robots/observation_sender.h"
#include "simulation/robots/senses.h"
#include "simulation/robots/terrain.h"

namespace hypermap::robots {

// What a robot has done.
struct RobotLog {
  int64_t goals = 0;        // looked round at
  int64_t unreachable = 0;  // goals with no way to them
  int64_t lost = 0;         // goals whose lease ended on the way
  int64_t frames = 0;
  double driven_m = 0.0;
  // Where it was, where it set out and where it turned.
  std::vector<Point> way;
};

// Lives in steps of simulated time, 0.2 s each; the server's time is another. Knows the server by
// the client alone. One thread.
class Robot {
 public:
  struct Task {
    std::string map;
    ObjectId exploration_id = 0;
    std::string name;
    std::string frame_id;  // the map's own
    // The leases that it asks for, of the server's time.
    absl::Duration lease = absl::Minutes(1);
    // A frame every so many steps, on the way and while it looks round.
    int frame_every = 3;
    int look_every = 1;
    // Waits until what others saw is on the map, before this robot asks for a goal or says that it
    // has looked round: what it is told must not depend on how fast they are heard. May be empty.
    std::function<absl::Status()> await_others = nullptr;
  };
  // `client`, `terrain` and `senses` must outlive it. `start` is passable.
  Robot(client::Client& client, const Terrain& terrain, Senses& senses, ObservationSender sender,
        Task task, const CellIndex& start);

  absl::Status Open() { return sender_.Open(); }
  // Lives through one step.
  absl::Status Step();
  // Waits until all that it saw is on the map.
  absl::Status Flush() { return sender_.Flush(); }
  // Gives its goal back.
  absl::Status Abandon();

  // It was told that the exploration has ended, and why.
  bool has_ended() const { return end_reason_.has_value(); }
  EndReason end_reason() const { return end_reason_.value_or(EndReason::kNone); }
  // There was nothing to do for it; it will ask again.
  bool is_waiting() const { return state_ == State::kIdle && until_claim_ > 0; }
  // What it is on the way to, or looks round at.
  const std::optional<client::Goal>& goal() const { return goal_; }
  const RobotLog& log() const { return log_; }

 private:
  enum class State { kIdle, kDriving, kLooking };

  // Waits until all that was seen is on the map.
  absl::Status AwaitAll();
  absl::Status Claim();
  // Gives the goal back; that it was lost meanwhile is no error.
  absl::Status Release(client::GoalOutcome outcome);
  // Before the lease ends. Forgets the goal when it has ended.
  absl::Status KeepLease();
  void PlanWay();
  // A step along the way; whether it has come to the end of it.
  bool Drive();
  // A step of turning on the spot; whether it has gone round.
  bool LookRound();
  absl::Status SendFrame();
  CellIndex Cell() const;

  client::Client& client_;
  const Terrain& terrain_;
  Senses& senses_;
  ObservationSender sender_;
  const Task task_;

  State state_ = State::kIdle;
  PlanarTransform pose_;
  PlanarTransform believed_;
  std::optional<client::Goal> goal_;
  absl::Time lease_end_;
  std::deque<Point> way_;  // the corners that are ahead
  double turned_rad_ = 0.0;
  int until_frame_ = 0;  // steps
  int until_claim_ = 0;
  std::optional<EndReason> end_reason_;
  RobotLog log_;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_ROBOT_H_
