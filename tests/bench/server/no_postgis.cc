// Replaces postgis.cc in builds without PostgreSQL.
#include "tests/bench/server/postgis.h"

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

}  // namespace hypermap::bench
