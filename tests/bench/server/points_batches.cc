#include "tests/bench/server/points_batches.h"

#include <random>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "hypermap/v1/query_service.pb.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/questions.h"

namespace hypermap::bench {
namespace {

constexpr int kBatches = 512;

}  // namespace

std::vector<PointsBatch> DrawBatches(const GeneratedSite& site) {
  std::mt19937_64 rng(77);
  std::uniform_real_distribution<double> place(0, site.side_m());
  std::vector<PointsBatch> batches(kBatches, PointsBatch(kBatch));
  for (PointsBatch& batch : batches) {
    for (Point& p : batch) p = {place(rng), place(rng)};
  }
  return batches;
}

StreamCalls BatchCallsOf(const std::string& method, const std::vector<PointsBatch>& batches) {
  StreamCalls calls;
  calls.method = method;
  for (const PointsBatch& batch : batches) {
    v1::QueryPointsRequest request;
    for (const Point& p : batch) {
      request.add_xs(p.x);
      request.add_ys(p.y);
    }
    calls.messages.push_back(ToBytes(request));
  }
  return calls;
}

StreamCalls PointsCalls(const std::vector<PointsBatch>& batches) {
  StreamCalls calls = BatchCallsOf(absl::StrCat(kQueryService, "QueryPoints"), batches);
  v1::QueryPointsRequest request;
  request.mutable_opening()->mutable_scope()->set_map(kSiteMap);
  calls.opening = ToBytes(request);
  return calls;
}

absl::StatusOr<Cost> CostOfStreams(const testing::ServerProcess& server, const Channels& channels,
                                   const StreamCalls& calls, absl::Duration duration) {
  const absl::Duration cpu = server.CpuTime();
  const absl::StatusOr<LoadResult> result = RunStreams(channels, calls, duration);
  HYPERMAP_RETURN_IF_ERROR(result.status());
  const auto count = static_cast<double>(result->calls);
  return Cost{absl::ToDoubleSeconds(server.CpuTime() - cpu) / count,
              absl::ToDoubleSeconds(result->wall) / count, result->Percentile(0.5),
              result->Percentile(0.99)};
}

}  // namespace hypermap::bench
