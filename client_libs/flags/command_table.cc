#include "client_libs/flags/command_table.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace hypermap::client {
namespace {

nlohmann::ordered_json Describe(const CLI::Option& option) {
  nlohmann::ordered_json names = nlohmann::ordered_json::array();
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  nlohmann::ordered_json described;
  described["names"] = std::move(names);
  described["positional"] = option.get_positional() ? option.get_name(true) : "";
  described["type"] = option.get_type_name();
  described["description"] = option.get_description();
  described["takes_value"] = option.get_items_expected_max() > 0;
  described["is_required"] = option.get_required();
  return described;
}

nlohmann::ordered_json Describe(const CLI::App& app) {
  nlohmann::ordered_json described;
  described["name"] = app.get_name();
  described["description"] = app.get_description();
  described["options"] = nlohmann::ordered_json::array();
  // Options and commands without a group are hidden.
  for (const CLI::Option* option : app.get_options({})) {
    if (!option->get_group().empty()) described["options"].push_back(Describe(*option));
  }
  described["commands"] = nlohmann::ordered_json::array();
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_group().empty()) described["commands"].push_back(Describe(*command));
  }
  return described;
}

}  // namespace

std::string CommandTable(const CLI::App& app) { return Describe(app).dump(2); }

void AddCommandTableOption(CLI::App& app) {
  // CLI11 prints the message of this exception, as for --version.
  app.add_flag_callback("--command_table",
                        [&app] { throw CLI::CallForVersion(CommandTable(app), 0); })
      ->group("");
}

}  // namespace hypermap::client
