#include "tests/bench/server/measure.h"

#include <time.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_format.h"
#include "base/status/status_macros.h"

namespace hypermap::bench {
namespace {

std::string Describe(const Cost& cost) {
  return absl::StrFormat("%.0f/s p50 %.0f us p99 %.0f us", 1 / cost.wall_s, cost.p50_s * 1e6,
                         cost.p99_s * 1e6);
}

}  // namespace

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

Cost MedianOf(const std::vector<Cost>& costs) {
  const auto of = [&costs](double Cost::*figure) {
    std::vector<double> values;
    for (const Cost& cost : costs) values.push_back(cost.*figure);
    return Median(std::move(values));
  };
  return {of(&Cost::cpu_s), of(&Cost::wall_s), of(&Cost::p50_s), of(&Cost::p99_s)};
}

absl::StatusOr<Contest> Alternate(const Pace& pace,
                                  const std::function<absl::StatusOr<Cost>()>& ours,
                                  const std::function<absl::StatusOr<Cost>()>& floor) {
  std::vector<Cost> costs[2];
  for (int round = 0; round <= pace.repeats; ++round) {
    for (const bool is_floor : {false, true}) {
      const absl::StatusOr<Cost> cost = is_floor ? floor() : ours();
      HYPERMAP_RETURN_IF_ERROR(cost.status());
      if (round > 0) costs[is_floor].push_back(*cost);
    }
  }
  return Contest{MedianOf(costs[0]), MedianOf(costs[1])};
}

absl::StatusOr<Cost> CostOfLoad(const testing::ServerProcess& server, const Channels& channels,
                                const Calls& calls, absl::Duration duration) {
  const absl::Duration cpu = server.CpuTime();
  const absl::StatusOr<LoadResult> result = RunLoad(channels, calls, duration);
  HYPERMAP_RETURN_IF_ERROR(result.status());
  const auto count = static_cast<double>(result->calls);
  return Cost{absl::ToDoubleSeconds(server.CpuTime() - cpu) / count,
              absl::ToDoubleSeconds(result->wall) / count, result->Percentile(0.5),
              result->Percentile(0.99)};
}

std::string Describe(const Contest& contest) {
  return absl::StrCat(Describe(contest.ours), "; floor ", Describe(contest.floor));
}

double ThreadCpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return absl::ToDoubleSeconds(absl::DurationFromTimespec(time));
}

}  // namespace hypermap::bench
