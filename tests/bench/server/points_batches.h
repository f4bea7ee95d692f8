// Batches of points for QueryPoints.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_POINTS_BATCHES_H_
#define HYPERMAP_TESTS_BENCH_SERVER_POINTS_BATCHES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/geometry/point.h"
#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/measure.h"
#include "tests/bench/server/stream_load.h"
#include "tests/support/server_process.h"

namespace hypermap::bench {

inline constexpr int kBatch = 256;
using PointsBatch = std::vector<Point>;

// Random points of the site, the same for every run.
std::vector<PointsBatch> DrawBatches(const GeneratedSite& site);

// Calls QueryPoints on the site's map.
StreamCalls PointsCalls(const std::vector<PointsBatch>& batches);
// Sends the same messages to another method, without an opening.
StreamCalls BatchCallsOf(const std::string& method, const std::vector<PointsBatch>& batches);

// Cost of a message for the server.
absl::StatusOr<Cost> CostOfStreams(const testing::ServerProcess& server, const Channels& channels,
                                   const StreamCalls& calls, absl::Duration duration);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_POINTS_BATCHES_H_
