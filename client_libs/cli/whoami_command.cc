// whoami.
#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {

void AddWhoamiCommand(CLI::App& app, Command& selected) {
  CLI::App* command =
      app.add_subcommand("whoami", "Show who you are to the server, and what you may do");
  command->callback([&selected] {
    selected = [](Session& s) {
      HYPERMAP_ASSIGN_OR_RETURN(const client::CallerAnswer caller, s.client.GetCaller());
      s.output.Show(caller);
      return absl::OkStatus();
    };
  });
}

}  // namespace hypermap::cli
