// bench: the load of a fleet.
#include <cstdlib>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "client_libs/bench/fleet.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {
namespace {

struct BenchOptions {
  bench::FleetOptions fleet;
  double seconds = 60.0;
  double warmup_seconds = 5.0;
};

absl::Status Bench(const BenchOptions& options, Session& s) {
  bench::FleetOptions fleet = options.fleet;
  fleet.duration = absl::Seconds(options.seconds);
  fleet.warmup = absl::Seconds(options.warmup_seconds);
  HYPERMAP_ASSIGN_OR_RETURN(const bench::FleetReport report,
                            bench::RunFleet(fleet, s.make_client, [&s](const std::string& line) {
                              s.err << line << std::endl;
                            }));
  s.output.Show(report);
  if (!report.holds()) s.exit_code = kExitError;
  return absl::OkStatus();
}

void AddFleetOptions(CLI::App& bench, bench::FleetOptions& fleet) {
  bench.add_option("--robots", fleet.robots, "Number of robots")->capture_default_str();
  bench.add_option("--observe_hz", fleet.observe_hz, "Observations of a robot in a second")
      ->capture_default_str();
  bench.add_option("--batches_hz", fleet.batches_hz, "Batches of points of a robot in a second")
      ->capture_default_str();
  bench.add_option("--batch_points", fleet.batch_points, "Points of a batch")
      ->capture_default_str();
  bench
      .add_option("--claims_hz", fleet.claims_hz,
                  "Goals that a robot claims and gives back in a second")
      ->capture_default_str();
  bench.add_option("--replicas", fleet.replicas, "Number of replicas of the map")
      ->capture_default_str();
  bench
      .add_option(
          "--full_replicas", fleet.full_replicas,
          "How many of the replicas apply the changes to a copy of the map; the others only "
          "receive and count them")
      ->capture_default_str();
  bench.add_option("--watchers", fleet.watchers, "Number of watches of the map")
      ->capture_default_str();
  bench.add_option("--editors", fleet.editors, "Number of editors")->capture_default_str();
  bench.add_option("--edits_hz", fleet.edits_hz, "Batches of an editor in a second")
      ->capture_default_str();
  bench.add_option("--seed", fleet.seed, "Seed of the random numbers")->capture_default_str();
}

}  // namespace

void AddBenchCommand(CLI::App& app, Command& selected) {
  auto options = std::make_shared<BenchOptions>();
  CLI::App* bench = app.add_subcommand(
      "bench",
      "Put the load of a fleet on the server, and report the latencies of its operations and "
      "whether anything was lost. Exit code 1: something was lost, or not all clients are back");
  bench->add_option("map", options->fleet.map, "Name of the map, which is created if it is absent")
      ->required()
      ->type_name("MAP");
  bench->add_flag("--into_existing", options->fleet.into_existing,
                  "Allow a map that has other layers than those of a load");
  AddFleetOptions(*bench, options->fleet);
  bench->add_option("--seconds", options->seconds, "Duration of the measured part")
      ->capture_default_str();
  bench
      ->add_option("--warmup_seconds", options->warmup_seconds,
                   "Duration of the part before, which does not count")
      ->capture_default_str();
  bench
      ->add_option(
          "--metrics", options->fleet.metrics,
          "Address of the server's metrics (--metrics_listen), from which its CPU time and "
          "memory are read")
      ->type_name("HOST:PORT");
  bench
      ->add_option("--scratch", options->fleet.scratch,
                   "Folder in which full replicas keep their maps until the end; a run that is "
                   "killed leaves its folder hypermap-bench-* there (default: in memory)")
      ->type_name("FOLDER")
      ->check(CLI::ExistingDirectory);
  bench->callback([&selected, options] {
    // By default, one thread of gRPC polls the connections of all threads and wakes the others up.
    // With poll(2), each of the hundreds of threads of a load waits for its own connection, which
    // takes milliseconds off the latencies that the load adds. gRPC reads this when it starts.
    setenv("GRPC_POLL_STRATEGY", "poll", /*overwrite=*/0);
    selected = [options](Session& s) { return Bench(*options, s); };
  });
}

}  // namespace hypermap::cli
