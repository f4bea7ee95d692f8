// The operations of a robot: it sends observations, asks about points, and claims goals. Each kind
// has a thread of its own, and all of them use the robot's connection.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_ROBOT_WORKERS_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_ROBOT_WORKERS_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/bench/paced_worker.h"
#include "client_libs/cpp/client.h"
#include "map/geometry/point.h"
#include "map/observations/observation.h"

namespace hypermap::bench {

// The name of robot `number`.
std::string RobotName(int number);

// Sends observations to kObjectsLayer. The server recognises a repeated one by its sequence.
class ObserveWorker final : public PacedWorker {
 public:
  ObserveWorker(const Load& load, client::Client client, int robot);

  absl::Status Open() override;

  int64_t num_acknowledged() const { return num_acknowledged_; }
  // The newest revision of an accepted observation.
  Revision newest() const { return newest_; }
  // Asks the server which observations of the robot it has. Returns the number of acknowledged ones
  // that are not among them. DEADLINE_EXCEEDED if that takes longer than `limit`.
  absl::StatusOr<int64_t> CountLost(absl::Duration limit);

 private:
  void Prepare() override;
  absl::StatusOr<SteadyTime> Attempt(const RunTimes& times) override;
  absl::Status OpenStream(absl::Duration limit);
  // Sends observation_ and awaits its acknowledgement on the open stream.
  absl::StatusOr<client::Acknowledgement> Ask();
  // FAILED_PRECONDITION if the server has refused the observation.
  absl::Status Take(const client::Acknowledgement& acknowledgement);

  const std::string robot_;
  Observation observation_;
  std::unique_ptr<client::ObserveStream> stream_;  // null: not connected
  int64_t next_sequence_ = 0;
  int64_t num_acknowledged_ = 0;
  std::vector<client::SequenceRange> acknowledged_;
  Revision newest_ = 0;
};

// Asks about batches of points in all layers of the map.
class PointsWorker final : public PacedWorker {
 public:
  PointsWorker(const Load& load, client::Client client, int robot);

  absl::Status Open() override;

 private:
  void Prepare() override;
  absl::StatusOr<SteadyTime> Attempt(const RunTimes& times) override;

  std::vector<Point> points_;
  std::unique_ptr<client::PointsStream> stream_;  // null: not connected
};

// Claims goals of the exploration, and gives them back at once. Only the claim is measured.
class ClaimWorker final : public PacedWorker {
 public:
  ClaimWorker(const Load& load, client::Client client, int robot);

  absl::Status Open() override { return absl::OkStatus(); }

 private:
  void Prepare() override;
  absl::StatusOr<SteadyTime> Attempt(const RunTimes& times) override;

  const std::string robot_;
  Point place_;
  std::string request_id_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_ROBOT_WORKERS_H_
