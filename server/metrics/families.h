// Makes families of metrics, as prometheus-cpp prints them.
#ifndef HYPERMAP_SERVER_METRICS_FAMILIES_H_
#define HYPERMAP_SERVER_METRICS_FAMILIES_H_

#include <prometheus/client_metric.h>
#include <prometheus/metric_family.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace hypermap::server {

using Labels = std::vector<prometheus::ClientMetric::Label>;

// A family that grows by its metrics.
class Family {
 public:
  Family(std::string name, std::string help, prometheus::MetricType type) {
    family_.name = std::move(name);
    family_.help = std::move(help);
    family_.type = type;
  }

  Family& Add(Labels labels, double value);
  // For histograms: `counts` are the numbers of each class, of which the last has no bound.
  template <typename Bounds, typename Counts>
  Family& AddHistogram(Labels labels, const Bounds& bounds, const Counts& counts, double sum);

  // So that a family is returned and listed as prometheus-cpp's own.
  // NOLINTNEXTLINE(google-explicit-constructor)
  operator prometheus::MetricFamily() && { return std::move(family_); }

 private:
  prometheus::ClientMetric& AddMetric(Labels labels);

  prometheus::MetricFamily family_;
};

template <typename Bounds, typename Counts>
Family& Family::AddHistogram(Labels labels, const Bounds& bounds, const Counts& counts,
                             double sum) {
  prometheus::ClientMetric::Histogram& histogram = AddMetric(std::move(labels)).histogram;
  uint64_t total = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    total += static_cast<uint64_t>(counts[i]);
    const double bound = i < bounds.size() ? bounds[i] : std::numeric_limits<double>::infinity();
    histogram.bucket.push_back({total, bound});
  }
  histogram.sample_count = total;
  histogram.sample_sum = sum;
  return *this;
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_METRICS_FAMILIES_H_
