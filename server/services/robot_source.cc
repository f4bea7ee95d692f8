#include "server/services/robot_source.h"

#include <algorithm>
#include <limits>

#include "absl/status/status.h"
#include "base/status/status_macros.h"
#include "hypermap/v1/robot_service.pb.h"
#include "server/rpc/raw_messages.h"
#include "wire/robot.h"

namespace hypermap::server {

RobotsAt DescribeRobotsAt(const MapSession& session, const Snapshot& snapshot) {
  return {snapshot.revision, session.incarnation(), snapshot.frame_id,
          session.options().clock->Now()};
}

absl::StatusOr<LiveSource::Step> RobotSource::Next(SteadyTime now, grpc::Slice* message) {
  gathers_ = false;
  if (session_->feed().closed()) {
    HYPERMAP_RETURN_IF_ERROR(session_->problem());
    return absl::UnavailableError("the map is closing");
  }
  const MapRobots::Changes changes =
      session_->robots().ReadAfter(told_, limits_.chunk_items, limits_.max_chunk_bytes);
  const bool is_idle = !changes.reset && changes.number == told_;
  if (is_idle && now < last_message_ + limits_.watch_progress) return Step::kNothingNew;

  const SnapshotPtr snapshot = session_->snapshot();
  v1::WatchRobotsResponse response;
  wire::EncodeRobotsAt(DescribeRobotsAt(*session_, *snapshot), &response);
  response.set_reset(changes.reset);
  response.set_more(changes.more);
  for (const RobotPresence& robot : changes.robots) {
    wire::EncodePresence(InMapFrame(robot, snapshot->frames, snapshot->frame_id),
                         response.add_robots());
  }
  response.mutable_forgotten()->Assign(changes.forgotten.begin(), changes.forgotten.end());
  *message = Serialize(response);
  told_ = changes.number;
  last_message_ = now;
  gathers_ = !changes.more;
  items_ += response.robots_size();
  return Step::kMessage;
}

absl::Duration RobotSource::idle_for(SteadyTime now) const {
  const absl::Duration until_progress = last_message_ + limits_.watch_progress - now;
  return std::max(absl::ZeroDuration(), std::min(until_progress, session_->robots().UntilChange()));
}

void RobotSource::BeginWait(const std::shared_ptr<WakeHandle>& wake_handle) {
  const auto wake = [wake_handle] { wake_handle->Wake(); };
  robots_wait_ = session_->robots().Await(told_, wake);
  // No revision is that large: the feed calls when it is closed.
  closing_wait_ = session_->feed().Await(std::numeric_limits<Revision>::max(), wake);
}

void RobotSource::EndWait() {
  if (robots_wait_) session_->robots().Remove(*std::exchange(robots_wait_, std::nullopt));
  if (closing_wait_) session_->feed().Remove(*std::exchange(closing_wait_, std::nullopt));
}

}  // namespace hypermap::server
