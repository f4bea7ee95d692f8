// servers.
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {

void AddServersCommand(CLI::App& app, Command& selected) {
  CLI::App* command = app.add_subcommand(
      "servers", "List the servers that share a database, and who owns each map");
  command->callback([&selected] {
    selected = [](Session& s) {
      HYPERMAP_ASSIGN_OR_RETURN(const client::ServerList list, s.client.ListServers());
      s.output.Show(list);
      return absl::OkStatus();
    };
  });
}

}  // namespace hypermap::cli
