// Replaces the files that use PostgreSQL in builds without it.
#include <string>

#include "tests/bench/server/postgis.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

absl::Status NotBuilt() {
  return absl::NotFoundError("not measured: built with -DHYPERMAP_POSTGRES=OFF");
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgisCluster>> PostgisCluster::Start() { return NotBuilt(); }

absl::Status PostgisCluster::Load(const GeneratedSite&) { return NotBuilt(); }

absl::StatusOr<Cost> PostgisCluster::Run(const SqlCalls&, int, absl::Duration) const {
  return NotBuilt();
}

absl::StatusOr<std::vector<int>> PostgisCluster::CountRows(const SqlCalls&, int) const {
  return NotBuilt();
}

absl::Status AddDatabaseRows(Bench& bench) {
  bench.report.AddMissing("servers that share a database", AtLeast(0),
                          std::string(NotBuilt().message()));
  return absl::OkStatus();
}

}  // namespace hypermap::bench
