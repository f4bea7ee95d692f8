// What a robot does: it sends observations, asks about points, and claims goals. Each has a thread
// of its own, and all use the robot's connection.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_ROBOT_WORKERS_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_ROBOT_WORKERS_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/bench/fleet_options.h"
#include "client_libs/bench/imagined_site.h"
#include "client_libs/bench/outages.h"
#include "client_libs/bench/schedule.h"
#include "client_libs/bench/worker.h"
#include "client_libs/cpp/client.h"

namespace hypermap::bench {

// What the workers of a load share. All outlive the workers.
struct Load {
  const FleetOptions& options;
  const ImaginedSite& site;
  OutageLog& outages;
};

// Does one operation at each time of a schedule, one after the other. An operation whose time comes
// while the one before is not answered begins late, and is still measured from its time.
class PacedWorker : public Worker {
 public:
  // `role` and `number` choose the random numbers.
  PacedWorker(OperationKind kind, const Load& load, double hz, uint64_t role, uint64_t number);

  void Run(const RunTimes& times) final;

 protected:
  // Does the next operation, with repeats after errors until times.give_up. Returns when it was
  // answered; nullopt if it was not.
  virtual std::optional<SteadyTime> Do(const RunTimes& times) = 0;

  // Notes an error of an attempt.
  void NoteFailure(const absl::Status& why);
  const Load& load() const { return load_; }
  Random& random() { return random_; }

 private:
  const Load load_;
  const double hz_;
  Random random_;
};

// The name of robot `number`.
std::string RobotName(int number);

// Sends observations to kObjectsLayer. Its client number in the OutageLog is `outage_client`.
class ObserveWorker final : public PacedWorker {
 public:
  ObserveWorker(const Load& load, client::Client client, int robot, int outage_client);

  absl::Status Open() override;

  int64_t num_acknowledged() const { return num_acknowledged_; }
  // The newest revision of an accepted observation.
  Revision newest() const { return newest_; }
  // Asks the server which observations of the robot it has. Returns the number of acknowledged ones
  // that are not among them. DEADLINE_EXCEEDED if that takes longer than `limit`.
  absl::StatusOr<int64_t> CountLost(absl::Duration limit);

 private:
  std::optional<SteadyTime> Do(const RunTimes& times) override;
  absl::Status OpenStream(absl::Duration limit);
  // Sends the observation and awaits its acknowledgement on the open stream.
  absl::StatusOr<client::Acknowledgement> Ask(const Observation& observation);
  // Returns whether the observation counts as acknowledged.
  bool Take(const client::Acknowledgement& acknowledgement);

  client::Client client_;
  const std::string robot_;
  const int outage_client_;
  std::unique_ptr<client::ObserveStream> stream_;  // null: not connected
  int64_t next_sequence_ = 0;
  int64_t num_acknowledged_ = 0;
  std::vector<client::SequenceRange> acknowledged_;
  Revision newest_ = 0;
};

// Asks about batches of points in all layers of the map.
class PointsWorker final : public PacedWorker {
 public:
  PointsWorker(const Load& load, client::Client client, int robot, int outage_client);

  absl::Status Open() override;

 private:
  std::optional<SteadyTime> Do(const RunTimes& times) override;

  client::Client client_;
  const int outage_client_;
  std::unique_ptr<client::PointsStream> stream_;  // null: not connected
};

// Claims goals of the exploration, and gives them back at once. Only the claim is measured.
class ClaimWorker final : public PacedWorker {
 public:
  ClaimWorker(const Load& load, client::Client client, int robot);

  absl::Status Open() override { return absl::OkStatus(); }

 private:
  std::optional<SteadyTime> Do(const RunTimes& times) override;

  client::Client client_;
  const std::string robot_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_ROBOT_WORKERS_H_
