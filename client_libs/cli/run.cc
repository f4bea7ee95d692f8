#include "client_libs/cli/run.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/json_output.h"
#include "client_libs/cli/table_output.h"
#include "client_libs/cli/text_table.h"
#include "client_libs/cli/validators.h"
#include "client_libs/cpp/client.h"
#include "client_libs/flags/command_table.h"
#include "client_libs/flags/connection_flags.h"

namespace hypermap::cli {
namespace {

constexpr char kDescription[] =
    "Queries and edits the maps of a Hypermap server.\n"
    "Coordinates are metres in the map's own frame unless --frame names another.";

struct GlobalOptions {
  client::ConnectionFlags connection;
  bool json = false;
  std::string timeout = "0";
  std::string retry = "0";
};

void AddGlobalOptions(CLI::App& app, GlobalOptions& options) {
  client::AddConnectionFlags(app, options.connection);
  app.add_flag("--json", options.json, "Print JSON");
  app.add_option("--timeout", options.timeout,
                 "Give up after this time (30s, 2m); 0 disables the limit")
      ->type_name("DURATION")
      ->check(IsTimeout())
      ->capture_default_str();
  app.add_option(
         "--retry", options.retry,
         "Retry for this long (30s, 2m) while the server is unavailable; 0 disables retries")
      ->type_name("DURATION")
      ->check(IsTimeout())
      ->capture_default_str();
  app.set_version_flag("--version", "hypermap " HYPERMAP_VERSION);
}

// Turns -.5 into -0.5, because CLI11 takes -2.5 for a number but -.5 for a flag.
void SpellOutLeadingZeros(std::vector<std::string>& args) {
  for (std::string& arg : args) {
    if (arg.size() > 2 && arg[0] == '-' && arg[1] == '.' && absl::ascii_isdigit(arg[2])) {
      arg.insert(1, "0");
    }
  }
}

// Allows options of the program after those of a command.
void FallThroughEverywhere(CLI::App& app) {
  app.fallthrough();
  for (CLI::App* subcommand : app.get_subcommands({})) FallThroughEverywhere(*subcommand);
}

// `exit_code` becomes that of the program, also after an error.
absl::Status Execute(const GlobalOptions& options, const Command& command, std::istream& in,
                     std::ostream& out, std::ostream& err, int* exit_code) {
  absl::Duration timeout;
  if (!absl::ParseDuration(options.timeout, &timeout) || timeout == absl::ZeroDuration()) {
    timeout = absl::InfiniteDuration();
  }
  absl::Duration retry_for;
  if (!absl::ParseDuration(options.retry, &retry_for)) retry_for = absl::ZeroDuration();
  HYPERMAP_ASSIGN_OR_RETURN(
      client::Client client,
      client::MakeClient(options.connection, {.timeout = timeout, .retry_for = retry_for}));
  std::unique_ptr<Output> output = options.json ? MakeJsonOutput(out) : MakeTableOutput(out);
  const auto make_client = [&options](client::ClientOptions of_client) {
    return client::MakeClient(options.connection, std::move(of_client));
  };
  Session session{client, in, *output, err, timeout, make_client};
  const absl::Status status = command(session);
  *exit_code = status.ok() ? session.exit_code : session.failure_code;
  if (absl::IsUnavailable(status) && session.uses_server) {
    return absl::UnavailableError(
        absl::StrCat("server ", options.connection.server, ": ", status.message()));
  }
  HYPERMAP_RETURN_IF_ERROR(status);
  if (out.flush()) return absl::OkStatus();
  *exit_code = session.failure_code;
  return absl::DataLossError("the output could not be written");
}

int Fail(std::ostream& err, const std::string& message, int exit_code) {
  err << "hypermap: " << OneLine(message) << std::endl;
  return exit_code;
}

}  // namespace

int Run(std::vector<std::string> args, std::istream& in, std::ostream& out, std::ostream& err,
        absl::FunctionRef<void()> start_grpc) {
  CLI::App app(kDescription, "hypermap");
  GlobalOptions options;
  Command command;
  AddGlobalOptions(app, options);
  AddCatalogCommands(app, command);
  AddEstimateCommand(app, command);
  AddTransferCommands(app, command);
  AddCheckCommand(app, command);
  AddDigestCommand(app, command);
  AddMigrateCommand(app, command);
  AddQueryCommands(app, command);
  AddWatchCommands(app, command);
  AddIngestCommands(app, command);
  AddExploreCommands(app, command);
  AddRobotsCommand(app, command);
  AddServersCommands(app, command);
  AddWhoamiCommand(app, command);
  AddTokenCommands(app, command);
  AddEvalCommand(app, command);
  AddRenderCommand(app, command);
  AddBenchCommand(app, command);
  AddDemoCommand(app, command);
  client::AddCommandTableOption(app);
  app.require_subcommand(1);
  FallThroughEverywhere(app);

  SpellOutLeadingZeros(args);
  std::reverse(args.begin(), args.end());  // CLI11 expects the reverse order
  try {
    app.parse(std::move(args));
  } catch (const CLI::CallForHelp&) {
    out << app.help();
    return kExitOk;
  } catch (const CLI::CallForAllHelp&) {
    out << app.help("", CLI::AppFormatMode::All);
    return kExitOk;
  } catch (const CLI::CallForVersion& version) {
    out << version.what() << '\n';
    return kExitOk;
  } catch (const CLI::Error& error) {
    return Fail(err, absl::StrCat(error.what(), " (see hypermap --help)"), kExitUsage);
  }

  start_grpc();
  int exit_code = kExitError;
  const absl::Status status = Execute(options, command, in, out, err, &exit_code);
  if (status.ok()) return exit_code;
  return Fail(err,
              absl::StrCat(absl::StatusCodeToString(status.code()), ": ",
                           absl::string_view(status.message())),
              exit_code);
}

}  // namespace hypermap::cli
