// servers, server drain.
#include <algorithm>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"
#include "client_libs/cli/describe.h"

namespace hypermap::cli {
namespace {

using client::ServerList;

// Time between two looks at the maps that a server still owns.
constexpr absl::Duration kPause = absl::Milliseconds(500);

struct DrainOptions {
  std::string server;
  bool undo = false;
};

absl::Status ListServers(Session& s) {
  HYPERMAP_ASSIGN_OR_RETURN(const ServerList list, s.client.ListServers());
  s.output.Show(list);
  return absl::OkStatus();
}

// What is left of a server that is drained; empty if it owns no map, or lives no more. ABORTED if
// it is not drained any more.
absl::StatusOr<std::string> DescribeRest(const ServerList& list, const std::string& id) {
  const auto server = std::find_if(list.servers.begin(), list.servers.end(),
                                   [&](const ServerList::Server& s) { return s.id == id; });
  if (server == list.servers.end()) return "";
  if (!server->draining) {
    return absl::AbortedError(
        absl::StrCat(id, " was started anew, or its draining was undone, and may own maps"));
  }
  if (server->num_maps == 0) return "";
  const bool has_successor = std::any_of(list.servers.begin(), list.servers.end(),
                                         [](const ServerList::Server& s) { return !s.draining; });
  return absl::StrCat(id, " owns ", Counted(server->num_maps, "map"),
                      has_successor ? "" : ", which no other server takes: all are drained");
}

absl::Status AwaitNoMaps(const std::string& id, Session& s) {
  const absl::Time deadline = absl::Now() + s.timeout;
  std::string told;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const ServerList list, s.client.ListServers());
    HYPERMAP_ASSIGN_OR_RETURN(const std::string rest, DescribeRest(list, id));
    if (rest.empty()) return absl::OkStatus();
    if (rest != told) s.err << rest << std::endl;
    told = rest;
    if (absl::Now() >= deadline) return absl::DeadlineExceededError(absl::StrCat(rest, " still"));
    absl::SleepFor(std::min(kPause, deadline - absl::Now()));
  }
}

absl::Status DrainServer(const DrainOptions& options, Session& s) {
  HYPERMAP_RETURN_IF_ERROR(s.client.DrainServer(options.server, options.undo));
  if (!options.undo) HYPERMAP_RETURN_IF_ERROR(AwaitNoMaps(options.server, s));
  s.output.Show(ServerState{options.server, !options.undo});
  return absl::OkStatus();
}

}  // namespace

void AddServersCommands(CLI::App& app, Command& selected) {
  CLI::App* servers = app.add_subcommand(
      "servers", "List the servers that share a database, and who owns each map");
  servers->callback([&selected] { selected = ListServers; });

  auto options = std::make_shared<DrainOptions>();
  CLI::App* server =
      app.add_subcommand("server", "Change one of the servers that share a database");
  server->require_subcommand(1);
  CLI::App* drain = server->add_subcommand(
      "drain", "Give the maps of a server to the others, and wait until it owns none");
  drain->add_option("id", options->server, "Id of the server (hypermap servers)")
      ->required()
      ->type_name("ID");
  drain->add_flag("--undo", options->undo, "Let the server own maps again");
  drain->callback([&selected, options] {
    selected = [options](Session& s) { return DrainServer(*options, s); };
  });
}

}  // namespace hypermap::cli
