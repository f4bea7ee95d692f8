// The rows of the report. Each is measured in turns with its floor or peer.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_ROWS_H_
#define HYPERMAP_TESTS_BENCH_SERVER_ROWS_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "tests/bench/server/generated_site.h"
#include "tests/bench/server/measure.h"
#include "tests/bench/server/report.h"
#include "tests/support/server_process.h"

namespace hypermap::bench {

struct Options {
  std::string server;        // hypermapd
  std::string floor_server;  // floor_server
  std::string cache = "build/bench/data";
  std::string scratch = "build/bench/scratch";
  std::string results = "build/bench/results.json";
  int64_t objects = 1'000'000;
  int64_t smallest = 100'000;    // for the scale row
  int64_t largest = 10'000'000;  // for the scale row
  int64_t import_objects = 200'000;
  int grid_side = 10'000;  // cells
  int questions = 4096;    // distinct ones of each kind
  int checked = 64;        // number of them compared with brute force
  int callers = 16;
  int watchers = 100;
  int changes_per_s = 1000;
  Pace pace;
  bool peers = false;
  bool pin = false;
};

// Connections to each database that answers the same questions.
inline constexpr int kConnectionsToPeers = 4;

// State that the rows share.
struct Bench {
  Options options;
  Report report;
  std::unique_ptr<testing::ServerProcess> floor;
  Channels floor_channels;  // options.callers
};

// A row that compares the CPU of two sides.
Row CpuRow(std::string name, const Contest& contest, const Target& target, std::string note);

// Starts a hypermapd on a folder of maps.
absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartHypermap(
    const Options& options, const std::string& data_dir,
    const std::vector<std::string>& flags = {});

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartFloor(const Options& options);

// Opening the site, its memory, and queries: one per call, and many per message. With options.peers
// also the same queries on other databases.
absl::Status AddSiteRows(Bench& bench);
// A query of an area of a grid.
absl::Status AddGridRow(Bench& bench);
// The cost of a query at the smallest and the largest number of objects.
absl::Status AddScaleRow(Bench& bench);
// Durable edits by one client and by many, queries while one client writes, and changes on their
// way to watchers.
absl::Status AddEditRows(Bench& bench);
absl::Status AddImportRow(Bench& bench);
// Edits in a PostgreSQL database, and a follower of a map: its lag, its queries and its start.
// Without PostgreSQL, adds a row that says that they were not measured.
absl::Status AddDatabaseRows(Bench& bench);

// The parts of AddSiteRows. `server` serves the site.
absl::Status AddOpenRows(Bench& bench, const GeneratedSite& site, const std::string& folder);
absl::Status AddQuestionRows(Bench& bench, const GeneratedSite& site,
                             const testing::ServerProcess& server);
// Measures the share of a QueryPoint's CPU that its admission takes.
absl::Status AddAdmissionRow(Bench& bench, const testing::ServerProcess& server,
                             const Channels& channels, const Calls& point_calls);
absl::Status AddPointsRows(Bench& bench, const GeneratedSite& site,
                           const testing::ServerProcess& server);
// Without options.peers, these add rows that say that they were not measured.
absl::Status AddPostgisRows(Bench& bench, const GeneratedSite& site,
                            const testing::ServerProcess& server);
absl::Status AddPeerRows(Bench& bench, const GeneratedSite& site,
                         const testing::ServerProcess& server);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_ROWS_H_
