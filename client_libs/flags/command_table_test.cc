#include "client_libs/flags/command_table.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

namespace hypermap::client {
namespace {

TEST(CommandTableTest, HasCommandsAndOptionsButNoHiddenOnes) {
  CLI::App app("Edits maps.", "edit");
  std::string file, map;
  app.add_option("-f,--file", file, "File to read")->type_name("FILE")->required();
  app.add_flag("--json", "Print JSON");
  AddCommandTableOption(app);
  CLI::App* remove = app.add_subcommand("remove", "Remove a map");
  remove->add_option("map", map, "Name of the map")->type_name("MAP");

  const auto table = nlohmann::json::parse(CommandTable(app));
  EXPECT_EQ(table["name"], "edit");
  EXPECT_EQ(table["description"], "Edits maps.");
  // The first option is --help.
  ASSERT_EQ(table["options"].size(), 3u);
  EXPECT_EQ(table["options"][1],
            nlohmann::json::parse(R"({"names": ["-f", "--file"], "positional": "", "type": "FILE",
                "description": "File to read", "takes_value": true, "is_required": true})"));
  EXPECT_EQ(table["options"][2]["takes_value"], false);
  ASSERT_EQ(table["commands"].size(), 1u);
  EXPECT_EQ(table["commands"][0]["name"], "remove");
  EXPECT_EQ(table["commands"][0]["options"][1]["positional"], "map");
}

TEST(CommandTableTest, TheOptionEndsTheProgramWithTheTable) {
  CLI::App app("Edits maps.", "edit");
  AddCommandTableOption(app);
  app.add_subcommand("remove", "Remove a map");
  app.require_subcommand(1);
  try {
    app.parse("--command_table");
    FAIL() << "parsed";
  } catch (const CLI::CallForVersion& shown) {
    EXPECT_EQ(shown.what(), CommandTable(app));
  }
}

}  // namespace
}  // namespace hypermap::client
