// Replaces postgis_rows.cc in builds without PostgreSQL's client library.
#include "tests/bench/server/postgis.h"

namespace hypermap::bench {
namespace {

absl::Status NotBuilt() {
  return absl::NotFoundError("not measured: built without libpq (tools/deps.sh bench)");
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgisCluster>> PostgisCluster::Start() { return NotBuilt(); }

PostgisCluster::~PostgisCluster() = default;

absl::Status PostgisCluster::Load(const GeneratedSite&) { return NotBuilt(); }

absl::StatusOr<Cost> PostgisCluster::Run(const SqlCalls&, int, absl::Duration) const {
  return NotBuilt();
}

absl::StatusOr<std::vector<int>> PostgisCluster::CountRows(const SqlCalls&, int) const {
  return NotBuilt();
}

}  // namespace hypermap::bench
