// digest.
#include <memory>
#include <string>

#include "base/status/status_macros.h"
#include "client_libs/cli/commands.h"

namespace hypermap::cli {

void AddDigestCommand(CLI::App& app, Command& selected) {
  auto map = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "digest",
      "Print digests of a map's layers, which are the same at each server that has the "
      "revision");
  command->add_option("map", *map, "Name of the map")->required()->type_name("MAP");
  command->callback([&selected, map] {
    selected = [map](Session& s) {
      HYPERMAP_ASSIGN_OR_RETURN(const client::DigestAnswer answer, s.client.DigestMap(*map));
      s.output.Show(answer);
      return absl::OkStatus();
    };
  });
}

}  // namespace hypermap::cli
