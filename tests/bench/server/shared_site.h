// The site in a PostgreSQL database that several servers share.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_SHARED_SITE_H_
#define HYPERMAP_TESTS_BENCH_SERVER_SHARED_SITE_H_

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "storage/libpq/testing/cluster.h"
#include "tests/bench/server/bare_database.h"
#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/measure.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {

// A cluster of its own, whose commits survive a power loss, with two databases that have the map
// kSiteMap alike: one for servers, and one to which only libpq writes. Stopped and removed at
// destruction.
class SharedSite {
 public:
  // NOT_FOUND if PostgreSQL is not installed.
  static absl::StatusOr<std::unique_ptr<SharedSite>> Make(const Options& options);

  const GeneratedSite& site() const { return site_; }

  // Starts a server on the database. The owner owns the map as long as it lives.
  absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartOwner() const;
  absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartFollower() const;

  // Calls that replace one object each. All calls of the run have request ids of their own.
  Calls EditCalls();

  // The sizes of the transactions that made the revisions after this one, in order.
  absl::StatusOr<std::vector<int>> GroupsAfter(Revision revision) const;
  // Writes the rows of such edits with nothing but libpq, in transactions of these sizes in turn,
  // for `each`. Only the transactions are timed.
  absl::StatusOr<Cost> BareEdits(const std::vector<int>& groups, absl::Duration each);

 private:
  explicit SharedSite(const Options& options);
  absl::Status Fill();
  absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartServer(const std::string& id) const;

  const Options& options_;
  const GeneratedSite site_;
  const ScratchFolder scratch_;
  std::unique_ptr<storage::postgres::Cluster> cluster_;
  std::string served_;  // connection strings of the databases
  std::string bare_target_;
  std::unique_ptr<BareDatabase> bare_;
  std::atomic<int64_t> edits_ = 0;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_SHARED_SITE_H_
