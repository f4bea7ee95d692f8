// The composition of a load.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_FLEET_OPTIONS_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_FLEET_OPTIONS_H_

#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"

namespace hypermap::bench {

// Layers of the load, which it creates.
inline constexpr char kObjectsLayer[] = "bench-objects";  // fused from observations
inline constexpr char kShapesLayer[] = "bench-shapes";    // edited
inline constexpr char kFloorLayer[] = "bench-floor";      // occupancy, for claims
inline constexpr char kExploredLayer[] = "bench-explored";

struct FleetOptions {
  std::string map;
  // True if the map may have layers besides those of the load.
  bool into_existing = false;
  int robots = 200;
  double observe_hz = 1.0;  // observations of a robot; here and below, 0: none
  double batches_hz = 5.0;  // batches of points of a robot
  int batch_points = 64;
  double claims_hz = 0.0;  // goals that a robot claims and releases
  int replicas = 50;
  // Number of the replicas that apply the changes to a copy of the map. The others only receive and
  // count the changes, because applying them for many robots takes the processors of many robots.
  int full_replicas = 5;
  int watchers = 50;
  int editors = 2;
  double edits_hz = 5.0;  // batches of an editor
  // The measured part of the run, and the part before it that does not count.
  absl::Duration duration = absl::Seconds(60);
  absl::Duration warmup = absl::Seconds(5);
  uint64_t seed = 1;
  // Folder below which full replicas keep their maps in files. Empty: they keep them in memory,
  // since the disks of robots are no load of the server. A run that is killed leaves its files.
  std::string scratch;
  // HOST:PORT of the server's metrics. Empty: the server is not measured.
  std::string metrics;
};

// INVALID_ARGUMENT naming the flag of the `bench` command that is wrong.
absl::Status Validate(const FleetOptions& options);

// Makes a client of the server with the caller's TLS and token.
using ClientFactory = std::function<absl::StatusOr<client::Client>(client::ClientOptions)>;

// Longest time to connect all clients; for answers that are outstanding when the load ends; and for
// watchers and replicas to reach the newest revision after that.
inline constexpr absl::Duration kConnectLimit = absl::Minutes(2);
inline constexpr absl::Duration kAnswerLimit = absl::Seconds(60);
inline constexpr absl::Duration kSettleLimit = absl::Minutes(2);

// For how long an attempt to connect is repeated by the client library before it counts as failed.
inline constexpr absl::Duration kAttemptLimit = absl::Seconds(5);

// Longest duration of a stream of the load.
absl::Duration LongestStream(const FleetOptions& options);

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_FLEET_OPTIONS_H_
