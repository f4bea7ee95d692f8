// Measures two servers in turns, so that other load on the machine affects both alike.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_MEASURE_H_
#define HYPERMAP_TESTS_BENCH_SERVER_MEASURE_H_

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "tests/bench/server/load.h"
#include "tests/support/server_process.h"

namespace hypermap::bench {

struct Pace {
  int repeats = 5;
  absl::Duration each = absl::Milliseconds(600);
};

double Median(std::vector<double> values);

// The cost of one operation, averaged over a run.
struct Cost {
  double cpu_s = 0;   // CPU of the server
  double wall_s = 0;  // duration of the run / operations
  double p50_s = 0;   // from request to answer
  double p99_s = 0;
};

// The median of each member.
Cost MedianOf(const std::vector<Cost>& costs);

struct Contest {
  Cost ours;
  Cost floor;

  double cpu_ratio() const { return ours.cpu_s / floor.cpu_s; }
};

// Runs `ours`, `floor`, `ours`, ... each pace.repeats times, after a round that is not counted.
absl::StatusOr<Contest> Alternate(const Pace& pace,
                                  const std::function<absl::StatusOr<Cost>()>& ours,
                                  const std::function<absl::StatusOr<Cost>()>& floor);

// Cost of calls of a server with `channels.size()` calls outstanding.
absl::StatusOr<Cost> CostOfLoad(const testing::ServerProcess& server, const Channels& channels,
                                const Calls& calls, absl::Duration duration);

// Rates and percentiles of both, for the note of a row.
std::string Describe(const Contest& contest);

// CPU seconds of the calling thread.
double ThreadCpuSeconds();

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_MEASURE_H_
