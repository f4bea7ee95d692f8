#include "simulation/robots/robot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "map/exploration/viewshed.h"
#include "simulation/worlds/drive.h"

namespace hypermap::robots {
namespace {

constexpr double kStride_m = simulation::kSpeed_m_per_s / simulation::kFramesPerSecond;
constexpr double kTurn_rad = simulation::kTurnRate_rad_per_s / simulation::kFramesPerSecond;
// Tolerance of angles, for the rounding errors of many small turns.
constexpr double kTurned_rad = 1e-6;
// Time between two reports of the pose, for a smooth picture of robots that drive faster than real.
constexpr absl::Duration kReportEvery = absl::Milliseconds(200);
// Steps between two claims if there was no goal.
constexpr int kPauseSteps = 5;
// Largest distance to a passable cell. Between two corners the robot may stop over a cell that is
// not passable.
constexpr double kBesideWay_m = 0.5;

// Returns the corners of a path after its first cell. Each is in sight of the next over passable
// cells, so that the robot can drive straight lines.
std::vector<CellIndex> Corners(const Terrain& terrain, const std::vector<CellIndex>& path) {
  std::vector<CellIndex> corners;
  for (size_t i = 0; i + 1 < path.size();) {
    size_t next = i + 1;
    while (next + 1 < path.size() && HasLineOfSight(terrain.passable(), path[i], path[next + 1])) {
      ++next;
    }
    corners.push_back(path[next]);
    i = next;
  }
  return corners;
}

}  // namespace

Robot::Robot(client::Client& client, const Terrain& terrain, Senses& senses,
             ObservationSender sender, Task task, const CellIndex& start)
    : client_(client),
      terrain_(terrain),
      senses_(senses),
      sender_(std::move(sender)),
      task_(std::move(task)) {
  const Point at = terrain_.geometry().CentreOf(start);
  pose_ = PlanarTransform(at.x, at.y, 0.0);
  believed_ = senses_.Localise(pose_);
  log_.way.push_back(at);
}

const char* Robot::StateWords(State state) {
  switch (state) {
    case State::kIdle:
      return "waiting for a goal";
    case State::kDriving:
      return "driving to a goal";
    case State::kLooking:
      return "looking around";
  }
  return "";
}

CellIndex Robot::Cell() const {
  const Point at{pose_.x(), pose_.y()};
  return terrain_.NearestPassable(at, kBesideWay_m).value_or(*terrain_.geometry().CellAt(at));
}

absl::Status Robot::Step() {
  absl::Status status = Report();
  if (status.ok()) status = KeepLease();
  if (status.ok() && state_ == State::kIdle && --until_claim_ < 0) status = Claim();
  if (!status.ok() || state_ == State::kIdle) return status;
  if (state_ == State::kDriving && Drive()) {
    state_ = State::kLooking;
    turned_rad_ = 0.0;
    until_frame_ = 0;
  } else if (state_ == State::kLooking && LookRound()) {
    if (status = AwaitAll(); !status.ok()) return status;
    ++log_.goals;
    return Release(client::GoalOutcome::kReached);
  }
  believed_ = senses_.Localise(pose_);
  if (--until_frame_ >= 0) return absl::OkStatus();
  until_frame_ = (state_ == State::kLooking ? task_.look_every : task_.frame_every) - 1;
  return SendFrame();
}

absl::Status Robot::Report() {
  const absl::Time now = absl::Now();
  if (now < next_report_) return absl::OkStatus();
  next_report_ = now + kReportEvery;
  client::RobotReport report;
  report.robot = task_.name;
  report.stamp = now;
  report.frame_id = task_.frame_id;
  report.frame_from_robot = believed_;
  report.state = StateWords(state_);
  return client_.ReportRobot(task_.map, report).status();
}

absl::Status Robot::AwaitAll() {
  const absl::Status status = Flush();
  return status.ok() && task_.await_others ? task_.await_others() : status;
}

absl::Status Robot::Claim() {
  HYPERMAP_RETURN_IF_ERROR(AwaitAll());
  const absl::Time asked = absl::Now();
  HYPERMAP_ASSIGN_OR_RETURN(
      const client::ClaimAnswer answer,
      client_.ClaimGoal(task_.map, task_.name, {believed_.x(), believed_.y()},
                        {.exploration_id = task_.exploration_id, .lease = task_.lease}));
  if (answer.state == ExplorationState::kEnded) {
    end_reason_ = answer.end_reason;
    return absl::OkStatus();
  }
  until_claim_ = kPauseSteps;
  if (!answer.goal) return absl::OkStatus();
  goal_ = answer.goal;
  lease_end_ = asked + task_.lease;
  until_claim_ = 0;
  PlanWay();
  if (state_ == State::kDriving) return absl::OkStatus();
  ++log_.unreachable;
  return Release(client::GoalOutcome::kUnreachable);
}

void Robot::PlanWay() {
  const std::optional<CellIndex> end = terrain_.geometry().CellAt(goal_->position);
  const std::vector<CellIndex> path =
      end ? terrain_.ShortestPath(Cell(), *end) : std::vector<CellIndex>();
  way_.clear();
  if (path.empty()) return;
  // The robot may stand beside the cell at which the path begins.
  way_.push_back(terrain_.geometry().CentreOf(path.front()));
  for (const CellIndex& corner : Corners(terrain_, path)) {
    way_.push_back(terrain_.geometry().CentreOf(corner));
  }
  state_ = State::kDriving;
  until_frame_ = 0;
}

absl::Status Robot::Release(client::GoalOutcome outcome) {
  const ObjectId goal = goal_->id;
  goal_.reset();
  way_.clear();
  state_ = State::kIdle;
  until_claim_ = 0;
  const absl::Status status = client_.ReleaseGoal(task_.map, task_.name, goal, outcome).status();
  return absl::IsNotFound(status) ? absl::OkStatus() : status;
}

absl::Status Robot::Abandon() {
  return goal_ ? Release(client::GoalOutcome::kAbandoned) : absl::OkStatus();
}

absl::Status Robot::KeepLease() {
  if (!goal_ || absl::Now() < lease_end_ - task_.lease / 2) return absl::OkStatus();
  const absl::Time asked = absl::Now();
  const absl::Status status =
      client_.RenewGoal(task_.map, task_.name, goal_->id, task_.lease).status();
  if (status.ok()) lease_end_ = asked + task_.lease;
  if (!absl::IsNotFound(status)) return status;
  ++log_.lost;
  goal_.reset();
  way_.clear();
  state_ = State::kIdle;
  until_claim_ = 0;
  return absl::OkStatus();
}

bool Robot::Drive() {
  while (!way_.empty() &&
         std::hypot(way_.front().x - pose_.x(), way_.front().y - pose_.y()) < 1e-9) {
    way_.pop_front();
    log_.way.push_back({pose_.x(), pose_.y()});
  }
  if (way_.empty()) return true;
  const double dx = way_.front().x - pose_.x(), dy = way_.front().y - pose_.y();
  const double heading = std::atan2(dy, dx);
  const double turn = std::remainder(heading - pose_.yaw(), 2.0 * std::numbers::pi);
  if (std::abs(turn) > kTurn_rad + kTurned_rad) {
    pose_ = {pose_.x(), pose_.y(), pose_.yaw() + std::copysign(kTurn_rad, turn)};
    return false;
  }
  const double left_m = std::hypot(dx, dy);
  const double stride_m = std::min(kStride_m, left_m);
  log_.driven_m += stride_m;
  // The last stride ends exactly on the corner, so that rounding errors do not add up and the goal,
  // a cell's centre, is reached.
  pose_ = stride_m == left_m ? PlanarTransform(way_.front().x, way_.front().y, heading)
                             : PlanarTransform(pose_.x() + stride_m / left_m * dx,
                                               pose_.y() + stride_m / left_m * dy, heading);
  return false;
}

bool Robot::LookRound() {
  turned_rad_ += kTurn_rad;
  pose_ = {pose_.x(), pose_.y(), pose_.yaw() + kTurn_rad};
  return turned_rad_ > 2.0 * std::numbers::pi - kTurned_rad;
}

absl::Status Robot::SendFrame() {
  HYPERMAP_ASSIGN_OR_RETURN(Observation observation, senses_.Observe(pose_, believed_));
  observation.robot = task_.name;
  observation.sequence = sender_.next_sequence();
  observation.frame_id = task_.frame_id;
  // The stamp is real time: simulated time may run ahead, and the server refuses stamps in the
  // future.
  observation.stamp = absl::Now();
  ++log_.frames;
  return sender_.Send(std::move(observation));
}

}  // namespace hypermap::robots
