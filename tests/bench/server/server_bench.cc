// Measures hypermapd over loopback against lower bounds of its cost.
//
// Starts real servers on generated maps, calls each in turns with a gRPC server that has no work
// behind its transport, and compares the CPU time that the server processes took per operation.
// Prints a table and writes a JSON list with an object for each row. The exit code is 1 if an
// answer is wrong or a server fails; targets are reported, not enforced.
#include <sched.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "tests/bench/server/map_files.h"
#include "tests/bench/server/rows.h"

namespace hypermap::bench {
namespace {

// The command that starts a server: on the first processor if the options say so.
std::vector<std::string> OnItsProcessor(const Options& options, std::vector<std::string> command) {
  if (options.pin) command.insert(command.begin(), {"/usr/bin/taskset", "--cpu-list", "0"});
  return command;
}

// Leaves the first processor to the servers. Called before there are other threads.
absl::Status LeaveTheFirstProcessor() {
  cpu_set_t processors;
  if (sched_getaffinity(0, sizeof processors, &processors) != 0 || CPU_COUNT(&processors) < 2 ||
      !CPU_ISSET(0, &processors)) {
    return absl::FailedPreconditionError("--pin needs processor 0 and another one");
  }
  CPU_CLR(0, &processors);
  if (sched_setaffinity(0, sizeof processors, &processors) == 0) return absl::OkStatus();
  return absl::ErrnoToStatus(errno, "--pin");
}

}  // namespace

Row CpuRow(std::string name, const Contest& contest, const Target& target, std::string note) {
  Row row;
  row.name = std::move(name);
  row.ours = contest.ours.cpu_s * 1e6;
  row.floor = contest.floor.cpu_s * 1e6;
  row.unit = "us CPU";
  row.ratio = contest.cpu_ratio();
  row.target = target;
  row.note = std::move(note);
  return row;
}

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartHypermap(
    const Options& options, const std::string& data_dir, const std::vector<std::string>& flags) {
  std::vector<std::string> command = {options.server, absl::StrCat("--data_dir=", data_dir),
                                      "--log_level=warn"};
  command.insert(command.end(), flags.begin(), flags.end());
  auto server = std::make_unique<testing::ServerProcess>(
      OnItsProcessor(options, std::move(command)), data_dir + ".log");
  HYPERMAP_RETURN_IF_ERROR(server->Start());
  return server;
}

absl::StatusOr<std::unique_ptr<testing::ServerProcess>> StartFloor(const Options& options) {
  auto floor = std::make_unique<testing::ServerProcess>(
      OnItsProcessor(options, {options.floor_server}), options.scratch + "/floor.log");
  HYPERMAP_RETURN_IF_ERROR(floor->Start());
  return floor;
}

absl::Status AddSiteRows(Bench& bench) {
  const GeneratedSite site(bench.options.objects);
  const absl::StatusOr<std::string> folder = SiteFolder(bench.options.cache, site);
  HYPERMAP_RETURN_IF_ERROR(folder.status());
  absl::Status status = AddOpenRows(bench, site, *folder);
  HYPERMAP_RETURN_IF_ERROR(status);
  const auto server = StartHypermap(bench.options, *folder);
  HYPERMAP_RETURN_IF_ERROR(server.status());
  status = AddQuestionRows(bench, site, **server);
  HYPERMAP_RETURN_IF_ERROR(status);
  status = AddPointsRows(bench, site, **server);
  return status.ok() ? AddPeerRows(bench, site, **server) : status;
}

namespace {

using AddRows = absl::Status (*)(Bench&);
constexpr std::pair<const char*, AddRows> kGroups[] = {
    {"site", AddSiteRows},    {"grid", AddGridRow},          {"edits", AddEditRows},
    {"import", AddImportRow}, {"database", AddDatabaseRows}, {"scale", AddScaleRow}};

absl::Status Run(Bench& bench, const std::vector<std::string>& only) {
  std::error_code ignored;
  std::filesystem::create_directories(bench.options.scratch, ignored);
  auto floor = StartFloor(bench.options);
  HYPERMAP_RETURN_IF_ERROR(floor.status());
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
  CLI::App app("Measures hypermapd over loopback against the cheapest possible server.");
  app.add_option("--server", options.server, "Path of hypermapd")->required();
  app.add_option("--floor_server", options.floor_server, "Path of floor_server")->required();
  app.add_option("--cache", options.cache, "Folder in which generated maps are kept");
  app.add_option("--scratch", options.scratch, "Folder for maps that are written to");
  app.add_option("--results", options.results, "JSON file for the results");
  app.add_option("--objects", options.objects, "Number of objects of the site");
  app.add_option("--smallest", options.smallest, "Smallest number of objects in the scale row");
  app.add_option("--largest", options.largest, "Largest number of objects in the scale row");
  app.add_option("--import_objects", options.import_objects, "Number of objects of a bulk import");
  app.add_option("--grid_side", options.grid_side, "Number of cells along a side of the grid");
  app.add_option("--questions", options.questions, "Number of distinct queries of each kind");
  app.add_option("--checked", options.checked, "Number of queries that are checked by brute force");
  app.add_option("--watchers", options.watchers, "Number of watches of one map");
  app.add_option("--repeats", options.pace.repeats,
                 "Number of rounds for which each side is measured");
  app.add_option("--each_ms", each_ms, "Length of a round in milliseconds");
  app.add_option("--only", only,
                 "Measure only these groups of rows: site, grid, edits, import, database, scale");
  app.add_flag("--pin", options.pin,
               "Run the servers on processor 0 and the load on the others, which makes the figures "
               "of calls repeatable; not for groups whose servers need several processors");
  app.add_flag("--peers", options.peers,
               "Also measure PostGIS, SpatiaLite, SQLite, Boost and GEOS");
  CLI11_PARSE(app, argc, argv);
  options.pace.each = absl::Milliseconds(each_ms);
  absl::Status status = options.pin ? LeaveTheFirstProcessor() : absl::OkStatus();
  if (status.ok()) status = Run(bench, only);
  if (status.ok()) return EXIT_SUCCESS;
  std::fprintf(stderr, "server_bench: %s\n", status.ToString().c_str());
  return EXIT_FAILURE;
}

}  // namespace
}  // namespace hypermap::bench

int main(int argc, char** argv) {
  try {
    return hypermap::bench::Main(argc, argv);
  } catch (const std::exception& error) {  // of CLI11
    std::fprintf(stderr, "server_bench: %s\n", error.what());
    return EXIT_FAILURE;
  }
}
