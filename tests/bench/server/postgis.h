// PostgreSQL with PostGIS, in its own cluster on loopback, with the objects of a site.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_POSTGIS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_POSTGIS_H_

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/measure.h"

namespace hypermap::storage::postgres {
class Cluster;
}

namespace hypermap::bench {

// A prepared statement: its text, and the parameters of the i-th call.
struct SqlCalls {
  std::string sql;
  std::function<std::vector<std::string>(int64_t i)> parameters;
};

// Stopped and removed at destruction.
class PostgisCluster {
 public:
  // NOT_FOUND if the programs or the extension are not installed.
  static absl::StatusOr<std::unique_ptr<PostgisCluster>> Start();

  // Fills the table objects (id, label, existence, geom), with a GiST index on geom.
  absl::Status Load(const GeneratedSite& site);

  // Calls the prepared statement on `connections` connections. CPU time is that of the connections'
  // processes.
  absl::StatusOr<Cost> Run(const SqlCalls& calls, int connections, absl::Duration duration) const;

  // Returns the number of rows in the answer to each of the first `count` calls.
  absl::StatusOr<std::vector<int>> CountRows(const SqlCalls& calls, int count) const;

 private:
  explicit PostgisCluster(std::shared_ptr<storage::postgres::Cluster> cluster)
      : cluster_(std::move(cluster)) {}
  std::string ConnectionString() const;

  // Shared, because builds without PostgreSQL don't know the type.
  const std::shared_ptr<storage::postgres::Cluster> cluster_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_POSTGIS_H_
