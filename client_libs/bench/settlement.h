// Compares what the clients of a load know with the server, when the load has ended.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_SETTLEMENT_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_SETTLEMENT_H_

#include <memory>
#include <vector>

#include "client_libs/bench/edit_worker.h"
#include "client_libs/bench/fleet_options.h"
#include "client_libs/bench/followers.h"
#include "client_libs/bench/imagined_site.h"
#include "client_libs/bench/report.h"
#include "client_libs/bench/robot_workers.h"
#include "client_libs/cpp/client.h"

namespace hypermap::bench {

// The clients whose knowledge of the map is compared; not owned. Robots and editors have ended,
// while watchers and replicas still follow.
struct Witnesses {
  std::vector<ObserveWorker*> robots;
  std::vector<EditWorker*> editors;
  std::vector<WatchWorker*> watchers;  // also the replicas that only receive
  std::vector<ReplicaWorker*> replicas;
};

// Waits until watchers and replicas have the newest revision, at most for kSettleLimit, and
// compares. `start` is the map before the load. Leaves Consistency::unanswered to the caller.
Consistency Settle(client::Client& client, const FleetOptions& options, const ImaginedSite& site,
                   const client::MapEntry& start, const Witnesses& witnesses);

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_SETTLEMENT_H_
