// A simulated robot that explores: it claims a goal, drives there, looks around, and claims the
// next.
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

// Record of a robot's drive.
struct RobotLog {
  int64_t goals = 0;        // Goals where it has looked around.
  int64_t unreachable = 0;  // Goals without a path to them.
  int64_t lost = 0;         // Goals whose lease ended too early.
  int64_t frames = 0;
  double driven_m = 0.0;
  // Its path: the start and each place where it changed direction.
  std::vector<Point> way;
};

// Acts in steps of simulated time, 0.2 s each; leases, stamps and reports of its pose use real
// time. It uses the server through the client only. For use by one thread.
class Robot {
 public:
  struct Task {
    std::string map;
    ObjectId exploration_id = 0;
    std::string name;
    std::string frame_id;  // The map's own frame.
    // Duration of the leases that it requests, in the server's time.
    absl::Duration lease = absl::Minutes(1);
    // Steps per frame, on the way to a goal and while it looks around.
    int frame_every = 3;
    int look_every = 1;
    // Waits until the observations of the other robots are on the map. Called before this robot
    // claims a goal or reports it as reached, so that the server's answers do not depend on how
    // fast observations arrive. May be empty.
    std::function<absl::Status()> await_others = nullptr;
  };
  // `client`, `terrain` and `senses` must outlive the robot. REQUIRES: `start` is passable.
  Robot(client::Client& client, const Terrain& terrain, Senses& senses, ObservationSender sender,
        Task task, const CellIndex& start);

  absl::Status Open() { return sender_.Open(); }
  // Acts for one step.
  absl::Status Step();
  // Waits until all its observations are on the map.
  absl::Status Flush() { return sender_.Flush(); }
  // Releases its goal, if it has one.
  absl::Status Abandon();

  // Returns whether the server has told it that the exploration has ended, and why.
  bool has_ended() const { return end_reason_.has_value(); }
  EndReason end_reason() const { return end_reason_.value_or(EndReason::kNone); }
  // Returns whether there was no goal for it; it will claim again some steps later.
  bool is_waiting() const { return state_ == State::kIdle && until_claim_ > 0; }
  // The goal that it drives to or looks around at.
  const std::optional<LeasedGoal>& goal() const { return goal_; }
  const RobotLog& log() const { return log_; }

 private:
  enum class State { kIdle, kDriving, kLooking };

  static const char* StateWords(State state);

  // Tells the server where it believes to be, if it has not done so lately.
  absl::Status Report();
  // Waits until the observations of all robots are on the map.
  absl::Status AwaitAll();
  absl::Status Claim();
  // Releases the goal. It is no error if its lease has ended meanwhile.
  absl::Status Release(client::GoalOutcome outcome);
  // Renews the lease after half of its duration. Drops the goal if the lease has ended.
  absl::Status KeepLease();
  void PlanWay();
  // Drives one step along the path. Returns whether it is at the end.
  bool Drive();
  // Turns on the spot for one step. Returns whether it has turned all round.
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
  std::optional<LeasedGoal> goal_;
  absl::Time lease_end_;
  absl::Time next_report_ = absl::InfinitePast();
  std::deque<Point> way_;  // Remaining corners of the path.
  double turned_rad_ = 0.0;
  int until_frame_ = 0;  // Steps until the next frame.
  int until_claim_ = 0;  // Steps until the next claim.
  std::optional<EndReason> end_reason_;
  RobotLog log_;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_ROBOT_H_
