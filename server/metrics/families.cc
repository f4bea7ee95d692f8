#include "server/metrics/families.h"

namespace hypermap::server {

Family& Family::Add(Labels labels, double value) {
  prometheus::ClientMetric& metric = AddMetric(std::move(labels));
  if (family_.type == prometheus::MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  return *this;
}

prometheus::ClientMetric& Family::AddMetric(Labels labels) {
  prometheus::ClientMetric& metric = family_.metric.emplace_back();
  metric.label = std::move(labels);
  return metric;
}

}  // namespace hypermap::server
