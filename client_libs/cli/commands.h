// The groups of commands. Each function adds subcommands to the parser; parsing a command line then
// stores the command that it names in `selected`.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_COMMANDS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_COMMANDS_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <istream>
#include <ostream>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/cli/output.h"
#include "client_libs/cli/run.h"
#include "client_libs/cpp/client.h"

namespace hypermap::cli {

// Everything that a command uses.
struct Session {
  client::Client& client;
  std::istream& in;
  Output& output;
  // For messages about the progress of a long command.
  std::ostream& err;
  // Maximum duration of a command.
  absl::Duration timeout;
  // Makes further clients of the same server, with the same TLS and token.
  std::function<absl::StatusOr<client::Client>(client::ClientOptions)> make_client;
  // Exit codes of the program if the command succeeds, and if it fails.
  int exit_code = kExitOk;
  int failure_code = kExitError;
  // Whether errors are those of a server.
  bool uses_server = true;
};

using Command = std::function<absl::Status(Session&)>;

// Adds maps, map, layers, layer, alias, transforms, transform set. `selected` must outlive the
// parser.
void AddCatalogCommands(CLI::App& app, Command& selected);

// Adds transform estimate. After AddCatalogCommands.
void AddEstimateCommand(CLI::App& app, Command& selected);

// Adds import, edit, export, backup, restore.
void AddTransferCommands(CLI::App& app, Command& selected);

// Adds migrate.
void AddMigrateCommand(CLI::App& app, Command& selected);

// Adds check.
void AddCheckCommand(CLI::App& app, Command& selected);

// Adds digest.
void AddDigestCommand(CLI::App& app, Command& selected);

// Adds query point, points, area, value, nearest.
void AddQueryCommands(CLI::App& app, Command& selected);

// Adds watch, changes, log.
void AddWatchCommands(CLI::App& app, Command& selected);

// Adds rebuild, retract, explain.
void AddIngestCommands(CLI::App& app, Command& selected);

// Adds explore start, status, list, frontiers, stop.
void AddExploreCommands(CLI::App& app, Command& selected);

// Adds robots.
void AddRobotsCommand(CLI::App& app, Command& selected);

// Adds servers, server drain.
void AddServersCommands(CLI::App& app, Command& selected);

// Adds whoami.
void AddWhoamiCommand(CLI::App& app, Command& selected);

// Adds token create, list, revoke.
void AddTokenCommands(CLI::App& app, Command& selected);

// Adds eval.
void AddEvalCommand(CLI::App& app, Command& selected);

// Adds bench.
void AddBenchCommand(CLI::App& app, Command& selected);

// Adds demo.
void AddDemoCommand(CLI::App& app, Command& selected);

// Adds render.
void AddRenderCommand(CLI::App& app, Command& selected);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_COMMANDS_H_
