// Puts the load of a fleet on a server, and measures what its operations take.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_FLEET_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_FLEET_H_

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "client_libs/bench/fleet_options.h"
#include "client_libs/bench/report.h"

namespace hypermap::bench {

// Called every few seconds with a line of text.
using Progress = std::function<void(const std::string& line)>;

// Prepares the map, connects all clients, runs the load, and compares everything at the end; see
// docs/performance.md. Each robot, watcher, replica and editor has a connection of its own. The
// server may be restarted meanwhile: clients retry until it is back. Replicas write to a folder
// below `scratch`, which is removed unless the process is killed.
//
// Errors of Validate and Prepare; UNAVAILABLE or the server's error if not all clients can connect
// within kConnectLimit; RESOURCE_EXHAUSTED if there are too few threads. That the report does not
// hold is not an error.
absl::StatusOr<FleetReport> RunFleet(const FleetOptions& options, const ClientFactory& make_client,
                                     const Progress& progress);

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_FLEET_H_
