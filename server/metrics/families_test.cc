#include "server/metrics/families.h"

#include <gtest/gtest.h>
#include <prometheus/text_serializer.h>

#include <array>
#include <string>
#include <utility>

namespace hypermap::server {
namespace {

std::string TextOf(Family family) {
  return prometheus::TextSerializer().Serialize({std::move(family)});
}

TEST(FamilyTest, CountersAndGaugesHaveLabels) {
  Family counter("a_total", "Help.", prometheus::MetricType::Counter);
  counter.Add({{"x", "1"}}, 2).Add({{"x", "\"quoted\""}}, 3);
  EXPECT_EQ(TextOf(std::move(counter)),
            "# HELP a_total Help.\n# TYPE a_total counter\n"
            "a_total{x=\"1\"} 2\na_total{x=\"\\\"quoted\\\"\"} 3\n");
}

TEST(FamilyTest, HistogramsAreCumulative) {
  Family histogram("h", "Help.", prometheus::MetricType::Histogram);
  histogram.AddHistogram({}, std::array<double, 2>{1, 2}, std::array<int, 3>{5, 0, 7}, 100.0);
  EXPECT_EQ(TextOf(std::move(histogram)),
            "# HELP h Help.\n# TYPE h histogram\nh_count 12\nh_sum 100\n"
            "h_bucket{le=\"1\"} 5\nh_bucket{le=\"2\"} 5\nh_bucket{le=\"+Inf\"} 12\n");
}

}  // namespace
}  // namespace hypermap::server
