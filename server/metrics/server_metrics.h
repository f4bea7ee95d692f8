// The numbers of a server for Prometheus.
#ifndef HYPERMAP_SERVER_METRICS_SERVER_METRICS_H_
#define HYPERMAP_SERVER_METRICS_SERVER_METRICS_H_

#include <prometheus/collectable.h>
#include <prometheus/metric_family.h>

#include <string>
#include <vector>

#include "server/rpc/facilities.h"
#include "server/session/backup_meters.h"
#include "server/session/comparison_meters.h"

namespace hypermap::server {

// Reads the numbers when Prometheus asks for them; nothing is counted twice. The names of the rpcs'
// metrics are those of go-grpc-middleware, for which there are dashboards. Thread safe.
class ServerMetrics final : public prometheus::Collectable {
 public:
  // Everything that `facilities` points to must outlive this, and so must `backups` and
  // `comparisons`, which may be null.
  ServerMetrics(const Facilities& facilities, const BackupMeters* backups,
                const ComparisonMeters* comparisons = nullptr)
      : facilities_(facilities), backups_(backups), comparisons_(comparisons) {}

  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  const Facilities facilities_;
  const BackupMeters* const backups_;
  const ComparisonMeters* const comparisons_;
};

// A line for each map whose state is not kServing, with the state and its reason.
std::string NotesAboutMaps(const Site& site);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_METRICS_SERVER_METRICS_H_
