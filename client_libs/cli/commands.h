// The groups of commands. Each adds its subcommands to the parser; the one that a command line
// names puts what is to be done into `selected`.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_COMMANDS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_COMMANDS_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <istream>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client_libs/cli/output.h"
#include "client_libs/cpp/client.h"

namespace hypermap::cli {

// What a command works with.
struct Session {
  client::Client& client;
  std::istream& in;
  Output& output;
  // How long a command may take.
  absl::Duration timeout;
};

using Command = std::function<absl::Status(Session&)>;

// maps, map, layers, layer, alias, transforms, transform. `selected` must outlive the parser.
void AddCatalogCommands(CLI::App& app, Command& selected);

// import, edit, export, backup.
void AddTransferCommands(CLI::App& app, Command& selected);

// query point, points, area, value, nearest.
void AddQueryCommands(CLI::App& app, Command& selected);

// watch, changes, log.
void AddWatchCommands(CLI::App& app, Command& selected);

// rebuild, retract, explain.
void AddIngestCommands(CLI::App& app, Command& selected);

// explore start, status, list, frontiers, stop.
void AddExploreCommands(CLI::App& app, Command& selected);

// eval.
void AddEvalCommand(CLI::App& app, Command& selected);

// render.
void AddRenderCommand(CLI::App& app, Command& selected);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_COMMANDS_H_
