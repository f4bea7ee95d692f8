// Measures hypermapd over loopback against lower bounds of its cost.
//
// Starts real servers on generated maps, calls each in turns with a gRPC server that has no work
// behind its transport, and compares the CPU time that the server processes took per operation.
// Prints a table and writes a JSON list with an object for each row. The exit code is 1 if an
// answer is wrong or a server fails; goals are reported, not enforced.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartHypermap(
    const Options& options, const std::string& data_dir, const std::vector<std::string>& flags) {
  std::vector<std::string> command = {options.server, absl::StrCat("--data_dir=", data_dir),
                                      "--log_level=warn"};
  command.insert(command.end(), flags.begin(), flags.end());
  auto server = std::make_unique<testing::ServerProcess>(std::move(command), data_dir + ".log");
  if (absl::Status status = server->Start(); !status.ok()) return status;
  return server;
}

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartFloor(const Options& options) {
  auto floor = std::make_unique<testing::ServerProcess>(
      std::vector<std::string>{options.floor_server}, options.scratch + "/floor.log");
  if (absl::Status status = floor->Start(); !status.ok()) return status;
  return floor;
}

absl::Status AddSiteRows(Bench& bench) {
  const GeneratedSite site(bench.options.objects);
  const absl::StatusOr<std::string> folder = SiteFolder(bench.options.cache, site);
  if (!folder.ok()) return folder.status();
  absl::Status status = AddOpenRows(bench, site, *folder);
  if (!status.ok()) return status;
  const auto server = StartHypermap(bench.options, *folder);
  if (!server.ok()) return server.status();
  status = AddQuestionRows(bench, site, **server);
  if (!status.ok()) return status;
  status = AddPointsRows(bench, site, **server);
  return status.ok() ? AddPeerRows(bench, site, **server) : status;
}

namespace {

using AddRows = absl::Status (*)(Bench&);
constexpr std::pair<const char*, AddRows> kGroups[] = {{"site", AddSiteRows},
                                                       {"grid", AddGridRow},
                                                       {"edits", AddEditRows},
                                                       {"import", AddImportRow},
                                                       {"scale", AddScaleRow}};

absl::Status Run(Bench& bench, const std::vector<std::string>& only) {
  std::error_code ignored;
  std::filesystem::create_directories(bench.options.scratch, ignored);
  auto floor = StartFloor(bench.options);
  if (!floor.ok()) return floor.status();
  bench.floor = *std::move(floor);
  bench.floor_channels = OpenChannels(bench.floor->address(), bench.options.callers);
  // If something fails, the rows measured before it are still reported.
  absl::Status status;
  for (const auto& [name, add_rows] : kGroups) {
    if (!only.empty() && std::find(only.begin(), only.end(), name) == only.end()) continue;
    const absl::Status added = add_rows(bench);
    if (added.ok()) continue;
    status.Update(absl::Status(added.code(), absl::StrCat(name, ": ", added.message())));
    bench.report.AddMissing(absl::StrCat("the rest of ", name), AtMost(0),
                            std::string(added.message()));
  }
  bench.report.PrintTable();
  status.Update(bench.report.WriteJson(bench.options.results));
  return status;
}

int Main(int argc, char** argv) {
  Bench bench;
  Options& options = bench.options;
  std::vector<std::string> only;
  int each_ms = 600;
  CLI::App app("What hypermapd costs over loopback, held against the least that it could.");
  app.add_option("--server", options.server, "hypermapd")->required();
  app.add_option("--floor_server", options.floor_server, "floor_server")->required();
  app.add_option("--cache", options.cache, "Where generated maps are kept");
  app.add_option("--scratch", options.scratch, "Where maps that are written to lie");
  app.add_option("--results", options.results, "The JSON file");
  app.add_option("--objects", options.objects, "Objects of the site");
  app.add_option("--smallest", options.smallest, "Objects at the lower end of the scale line");
  app.add_option("--largest", options.largest, "Objects at its upper end");
  app.add_option("--import_objects", options.import_objects, "Objects of a bulk import");
  app.add_option("--grid_side", options.grid_side, "Cells along a side of the grid");
  app.add_option("--questions", options.questions, "Different questions of each kind");
  app.add_option("--checked", options.checked, "Of them, those checked by brute force");
  app.add_option("--watchers", options.watchers, "Watchers of one map");
  app.add_option("--repeats", options.pace.repeats, "Rounds that each side is measured");
  app.add_option("--each_ms", each_ms, "Length of a round in milliseconds");
  app.add_option("--only", only, "Groups of rows: site, grid, edits, import, scale");
  app.add_flag("--peers", options.peers, "Also PostGIS, SpatiaLite, SQLite, Boost and GEOS");
  CLI11_PARSE(app, argc, argv);
  options.pace.each = absl::Milliseconds(each_ms);
  const absl::Status status = Run(bench, only);
  if (status.ok()) return EXIT_SUCCESS;
  std::fprintf(stderr, "server_bench: %s\n", status.ToString().c_str());
  return EXIT_FAILURE;
}

}  // namespace
}  // namespace hypermap::bench

int main(int argc, char** argv) { return hypermap::bench::Main(argc, argv); }
