// Makes a map ready for a load.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_PREPARATION_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_PREPARATION_H_

#include "absl/status/statusor.h"
#include "client_libs/bench/fleet_options.h"
#include "client_libs/bench/imagined_site.h"
#include "client_libs/cpp/client.h"

namespace hypermap::bench {

// Creates the map and the layers of the load that do not exist, and starts an exploration if the
// load claims goals. Returns the map as it is then. FAILED_PRECONDITION if the map has other layers
// and options.into_existing is not set.
absl::StatusOr<client::MapEntry> Prepare(client::Client& client, const FleetOptions& options,
                                         const ImaginedSite& site);

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_PREPARATION_H_
