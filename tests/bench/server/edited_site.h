// The site while it is being edited.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_EDITED_SITE_H_
#define HYPERMAP_TESTS_BENCH_SERVER_EDITED_SITE_H_

#include <atomic>
#include <cstdint>
#include <memory>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "tests/bench/bare_map.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/measure.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {

// A server on a copy of the site, and another copy to which only SQLite writes.
class EditedSite {
 public:
  explicit EditedSite(const Options& options);

  absl::Status Open();

  const GeneratedSite& site() const { return site_; }
  const testing::ServerProcess& server() const { return *server_; }
  // Shared by all edits of the run.
  std::atomic<int64_t>* edit_counter() { return &edits_; }

  // Single edits by `clients` clients, each waiting for its answer.
  absl::StatusOr<Cost> OurEdits(int clients);
  // Commits of one row, each timed alone. The rows are prepared beforehand.
  absl::StatusOr<Cost> BareCommits();

 private:
  const Options& options_;
  const GeneratedSite site_;
  const ScratchFolder scratch_;
  std::unique_ptr<testing::ServerProcess> server_;
  std::unique_ptr<BareMap> bare_;
  std::atomic<int64_t> edits_ = 0;
};

// Adds the rows about delivering changes to watchers.
absl::Status AddWatchRows(Bench& bench, EditedSite& edited);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_EDITED_SITE_H_
