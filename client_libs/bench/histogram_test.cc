#include "client_libs/bench/histogram.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace hypermap::bench {
namespace {

constexpr double kPercents[] = {0.0, 1.0, 50.0, 90.0, 99.0, 99.9, 100.0};

int64_t ExactPercentile_us(std::vector<int64_t> values, double percent) {
  std::sort(values.begin(), values.end());
  const auto is_rank = [&](int64_t rank) { return rank * 1000 >= percent * 10 * values.size(); };
  int64_t rank = 1;
  while (!is_rank(rank)) ++rank;
  return values[rank - 1];
}

LatencyHistogram HistogramOf(const std::vector<int64_t>& values_us) {
  LatencyHistogram histogram;
  for (const int64_t value : values_us) histogram.Add(absl::Microseconds(value));
  return histogram;
}

void ExpectPercentilesOf(const LatencyHistogram& histogram, const std::vector<int64_t>& values_us) {
  ASSERT_EQ(histogram.count(), static_cast<int64_t>(values_us.size()));
  for (const double percent : kPercents) {
    const int64_t exact = ExactPercentile_us(values_us, percent);
    const int64_t found = absl::ToInt64Microseconds(histogram.Percentile(percent));
    EXPECT_GE(found, exact) << percent;
    EXPECT_LE(found, exact * (1.0 + LatencyHistogram::kRelativeError)) << percent;
  }
  EXPECT_EQ(histogram.max(),
            absl::Microseconds(*std::max_element(values_us.begin(), values_us.end())));
}

// Samples of distributions of different shapes, between 1 us and 1 h.
std::vector<std::vector<int64_t>> Samples(uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(1.0, 5e6);
  std::exponential_distribution<double> exponential(1.0 / 3000.0);
  std::lognormal_distribution<double> lognormal(8.0, 2.5);
  std::bernoulli_distribution is_slow(0.02);
  const std::vector<std::function<double()>> draws = {
      [&] { return uniform(random); }, [&] { return exponential(random); },
      [&] { return lognormal(random); },
      // Fast answers and few slow ones.
      [&] { return is_slow(random) ? 1e6 + uniform(random) : 200.0 + exponential(random) / 10.0; },
      // All powers of two alike.
      [&] { return std::exp2(uniform(random) / 5e6 * 31.0); }};
  std::vector<std::vector<int64_t>> samples;
  for (const auto& draw : draws) {
    std::vector<int64_t>& sample = samples.emplace_back();
    for (int i = 0; i < count; ++i) {
      sample.push_back(std::clamp<int64_t>(std::llround(draw()), 1, 3'600'000'000));
    }
  }
  return samples;
}

TEST(LatencyHistogramTest, WithoutValuesAllIsZero) {
  const LatencyHistogram histogram;
  EXPECT_EQ(histogram.count(), 0);
  EXPECT_EQ(histogram.Percentile(50.0), absl::ZeroDuration());
  EXPECT_EQ(histogram.max(), absl::ZeroDuration());
  EXPECT_EQ(histogram.Mean(), absl::ZeroDuration());
}

TEST(LatencyHistogramTest, SmallValuesAreExact) {
  for (int64_t value = 1; value < 128; ++value) {
    EXPECT_EQ(HistogramOf({value, 1'000'000}).Percentile(50.0), absl::Microseconds(value));
  }
}

TEST(LatencyHistogramTest, ValuesAtTheBordersOfBucketsKeepTheRelativeError) {
  for (int power = 6; power < 31; ++power) {
    for (const int64_t offset : {-1, 0, 1}) {
      const std::vector<int64_t> values = {(int64_t{1} << power) + offset, 3'600'000'000};
      ExpectPercentilesOf(HistogramOf(values), values);
    }
  }
}

TEST(LatencyHistogramTest, ValuesOutsideCountAsTheLimits) {
  LatencyHistogram histogram;
  histogram.Add(-absl::Seconds(5));
  EXPECT_EQ(histogram.Percentile(100.0), absl::Microseconds(1));
  histogram.Add(absl::InfiniteDuration());
  EXPECT_EQ(histogram.max(), absl::Hours(1));
  EXPECT_EQ(histogram.Percentile(100.0), absl::Hours(1));
  EXPECT_EQ(histogram.count(), 2);
}

TEST(LatencyHistogramTest, OneSlowValueInAThousandIsAboveThe99_9thPercentile) {
  std::vector<int64_t> values(999, 10);
  values.push_back(1'000'000);
  const LatencyHistogram histogram = HistogramOf(values);
  EXPECT_EQ(histogram.Percentile(99.9), absl::Microseconds(10));
  EXPECT_EQ(histogram.Percentile(99.91), absl::Seconds(1));
}

TEST(LatencyHistogramTest, MeanIsThatOfTheValues) {
  EXPECT_EQ(HistogramOf({1000, 2000, 6000}).Mean(), absl::Milliseconds(3));
}

TEST(LatencyHistogramTest, PercentilesAreThoseOfRandomSamples) {
  for (const uint64_t seed : {1, 2, 3}) {
    for (const int count : {1, 2, 99, 20'000}) {
      for (const std::vector<int64_t>& sample : Samples(seed, count)) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << count << " values");
        ExpectPercentilesOf(HistogramOf(sample), sample);
      }
    }
  }
}

TEST(LatencyHistogramTest, MergedHistogramsCountAllValues) {
  std::vector<int64_t> all;
  LatencyHistogram merged;
  for (const std::vector<int64_t>& sample : Samples(4, 5000)) {
    merged.Merge(HistogramOf(sample));
    all.insert(all.end(), sample.begin(), sample.end());
  }
  merged.Merge(LatencyHistogram());
  ExpectPercentilesOf(merged, all);
  EXPECT_EQ(merged.Mean(), HistogramOf(all).Mean());
}

}  // namespace
}  // namespace hypermap::bench
