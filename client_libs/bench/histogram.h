// Distribution of latencies in a fixed amount of memory.
//
//    LatencyHistogram latencies;
//    latencies.Add(absl::Milliseconds(3));
//    absl::Duration slow = latencies.Percentile(99.0);
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_HISTOGRAM_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_HISTOGRAM_H_

#include <cstdint>
#include <vector>

#include "absl/time/time.h"

namespace hypermap::bench {

// Counts durations from 1 us to 1 h in buckets whose width grows with the value: each power of two
// is divided into 64 buckets of equal width (as in HdrHistogram by Gil Tene). Values outside are
// counted as the nearest of the two limits. Takes 14 KB once it has a value. Not thread safe.
class LatencyHistogram {
 public:
  // A percentile exceeds the exact one by at most this share of it.
  static constexpr double kRelativeError = 1.0 / 64.0;

  void Add(absl::Duration value);
  // Adds all values of the other one.
  void Merge(const LatencyHistogram& other);

  int64_t count() const { return count_; }
  // The smallest value such that at least `percent` of the values are not greater (nearest rank),
  // rounded up to the end of its bucket. Thousandths of a percent count. REQUIRES: 0 <= percent <=
  // 100. Zero if there are no values.
  absl::Duration Percentile(double percent) const;
  // The largest value and the mean, in whole microseconds. Zero if there are no values.
  absl::Duration max() const { return absl::Microseconds(max_us_); }
  absl::Duration Mean() const;

 private:
  std::vector<int64_t> buckets_;  // empty before the first value
  int64_t count_ = 0;
  int64_t sum_us_ = 0;
  int64_t max_us_ = 0;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_HISTOGRAM_H_
