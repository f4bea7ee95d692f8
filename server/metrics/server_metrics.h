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
#include "storage/decorators/store_meters.h"

namespace hypermap::server {

// Reads the numbers when Prometheus asks for them; nothing is counted twice. The names of the rpcs'
// metrics are those of go-grpc-middleware, for which there are dashboards. Thread safe.
class ServerMetrics final : public prometheus::Collectable {
 public:
  // Meters of what not every server has; each may be null.
  struct Optional {
    const BackupMeters* backups = nullptr;
    const ComparisonMeters* comparisons = nullptr;
    const storage::StoreMeters* store = nullptr;
  };
  // Everything that `facilities` and `optional` point to must outlive this.
  ServerMetrics(const Facilities& facilities, const Optional& optional)
      : facilities_(facilities), optional_(optional) {}

  std::vector<prometheus::MetricFamily> Collect() const override;

 private:
  const Facilities facilities_;
  const Optional optional_;
};

// A line for each map whose state is not kServing, with the state and its reason.
std::string NotesAboutMaps(const Site& site);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_METRICS_SERVER_METRICS_H_
