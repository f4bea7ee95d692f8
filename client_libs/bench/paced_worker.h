// A client that carries out operations at the times of a schedule.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_PACED_WORKER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_PACED_WORKER_H_

#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_libs/bench/fleet_options.h"
#include "client_libs/bench/imagined_site.h"
#include "client_libs/bench/outages.h"
#include "client_libs/bench/schedule.h"
#include "client_libs/bench/worker.h"
#include "client_libs/cpp/backoff.h"
#include "client_libs/cpp/client.h"

namespace hypermap::bench {

// The site and the options, which all paced workers of a load share. They outlive the workers.
struct Load {
  const FleetOptions& options;
  const ImaginedSite& site;
  OutageLog& outages;
};

// Carries out one operation at a time. An operation that is due while the one before is not
// answered begins late, and its latency still runs from the time at which it was due. After an
// error that may pass, the operation is tried again, so that the report can count the retries; the
// client library's own retries must be off.
class PacedWorker : public Worker {
 public:
  // `role` and `number` choose the random numbers.
  PacedWorker(OperationKind kind, const Load& load, client::Client client, double hz,
              RandomRole role, int number);

  void Run(const RunTimes& times) final;

 protected:
  // Makes the next operation.
  virtual void Prepare() = 0;
  // Sends the operation that Prepare made, and returns when its answer came. May be called several
  // times for one operation, which the server must carry out only once.
  virtual absl::StatusOr<SteadyTime> Attempt(const RunTimes& times) = 0;
  // Called when the operation is not tried any more, although it has no answer.
  virtual void GiveUp() {}

  const Load& load() const { return load_; }
  client::Client& client() { return client_; }
  Random& random() { return random_; }

 private:
  // Returns when the operation was answered; nullopt if it was given up.
  std::optional<SteadyTime> CarryOut(const RunTimes& times);
  // Waits before the next attempt until the server answers. Returns false if there is no time left.
  bool AwaitServer(client::Backoff& backoff, const RunTimes& times);

  const Load load_;
  client::Client client_;
  const double hz_;
  const int outage_client_;
  Random random_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_PACED_WORKER_H_
