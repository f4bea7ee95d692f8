// The messages of one WatchRobots rpc.
#ifndef HYPERMAP_SERVER_SERVICES_ROBOT_SOURCE_H_
#define HYPERMAP_SERVER_SERVICES_ROBOT_SOURCE_H_

#include <grpcpp/support/slice.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/limits/limits.h"
#include "base/sync/steady_time.h"
#include "map/robots/robot_presence.h"
#include "server/presence/map_robots.h"
#include "server/session/map_session.h"
#include "server/watch/live_source.h"
#include "server/watch/wake_handle.h"

namespace hypermap::server {

// What an answer about the robots of a map says of the map and the time.
RobotsAt DescribeRobotsAt(const MapSession& session, const Snapshot& snapshot);

// Follows the robots of a map. Between two messages it holds a number only, and waits for a tick,
// so that a message has all that came meanwhile.
class RobotSource final : public LiveSource {
 public:
  RobotSource(const Limits& limits, std::shared_ptr<MapSession> session)
      : limits_(limits), session_(std::move(session)) {}

  // UNAVAILABLE if the map is closing, or its problem.
  absl::StatusOr<Step> Next(SteadyTime now, grpc::Slice* message) override;
  bool TakeShared(SteadyTime /*now*/, grpc::Slice* /*message*/) override { return false; }
  bool gathers() const override { return gathers_; }
  bool is_busy() const override { return true; }
  absl::Duration idle_for(SteadyTime now) const override;
  void BeginWait(const std::shared_ptr<WakeHandle>& wake_handle) override;
  void EndWait() override;
  // Number of robots.
  int64_t items() const override { return items_; }
  int64_t memory() const override { return 0; }
  bool holds_commits() const override { return false; }

 private:
  const Limits limits_;
  const std::shared_ptr<MapSession> session_;
  MapRobots::ChangeNumber told_ = 0;  // the last change that the reader knows
  SteadyTime last_message_ = SteadyTime::InfinitePast();
  bool gathers_ = false;
  int64_t items_ = 0;
  std::optional<MapRobots::WaitId> robots_wait_;
  std::optional<ChangeFeed::WaitId> closing_wait_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_ROBOT_SOURCE_H_
