// hypermap-ingest turns RGB-D frames with detections, which are recorded, sent by robots or
// simulated, into observations for a Hypermap server.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdlib>
#include <iostream>

#include "absl/status/status.h"
#include "client_libs/cpp/scoped_grpc.h"
#include "client_libs/flags/command_table.h"
#include "ingest/worker/correct_command.h"
#include "ingest/worker/interruption.h"
#include "ingest/worker/replay_command.h"
#include "ingest/worker/serve_command.h"
#include "ingest/worker/simulate_command.h"
#include "ingest/worker/smooth_command.h"

namespace hypermap::ingest {
namespace {

constexpr int kExitError = 1;  // The command failed.
constexpr int kExitUsage = 2;  // The command line is invalid.

int Main(int argc, char** argv) {
  CLI::App app("Turns RGB-D frames with detections into observations for a Hypermap server.",
               "hypermap-ingest");
  app.set_version_flag("--version", "hypermap-ingest " HYPERMAP_VERSION);
  app.require_subcommand(1);
  Command command;
  AddReplayCommand(app, command);
  AddCorrectCommand(app, command);
  AddSmoothCommand(app, command);
  AddServeCommand(app, command);
  AddSimulateCommand(app, command);
  client::AddCommandTableOption(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // --help and --version are reported as errors with code 0.
    if (error.get_exit_code() == 0) return app.exit(error);
    std::cerr << "hypermap-ingest: " << error.what() << " (see hypermap-ingest --help)\n";
    return kExitUsage;
  }
  std::signal(SIGPIPE, SIG_IGN);
  // The status of a failed call says everything; gRPC's own log would repeat it.
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  Interruption interruption;
  const SignalWatch watch(interruption);
  const client::ScopedGrpc grpc;  // after the watch, which blocks signals in all later threads
  const absl::Status status = command(interruption);
  if (status.ok()) return EXIT_SUCCESS;
  std::cerr << "hypermap-ingest: " << absl::StatusCodeToString(status.code()) << ": "
            << status.message() << std::endl;
  return kExitError;
}

}  // namespace
}  // namespace hypermap::ingest

int main(int argc, char** argv) {  // NOLINT(bugprone-exception-escape)
  return hypermap::ingest::Main(argc, argv);
}
