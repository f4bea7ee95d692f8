#include "server/limit_flags.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>

#include "absl/flags/reflection.h"
#include "absl/strings/match.h"
#include "gtest/gtest.h"

namespace hypermap::server {
namespace {

namespace fs = std::filesystem;

// Sets a flag as the command line does.
void Set(const std::string& name, const std::string& value) {
  absl::CommandLineFlag* const flag = absl::FindCommandLineFlag(name);
  ASSERT_NE(flag, nullptr) << name;
  std::string error;
  ASSERT_TRUE(flag->ParseFrom(value, &error)) << error;
}

std::string CheckError() { return std::string(CheckLimitFlags().message()); }

TEST(LimitFlagsTest, DefaultsAreThoseOfTheStruct) {
  EXPECT_TRUE(LimitsOfFlags() == Limits());
  EXPECT_EQ(CheckLimitFlags(), absl::OkStatus());
}

TEST(LimitFlagsTest, FlagSetsItsLimit) {
  const absl::FlagSaver saver;
  Set("max_cells", "7");
  Set("history_age", "3s");
  Limits expected;
  expected.max_cells = 7;
  expected.history_age = absl::Seconds(3);
  EXPECT_TRUE(LimitsOfFlags() == expected);
}

TEST(LimitFlagsTest, ValueThatIsTooSmallIsRefusedByName) {
  const struct {
    const char* flag;
    const char* value;
    const char* error;
  } cases[] = {
      {"max_edits", "0", "--max_edits must be positive"},
      {"max_import_bytes", "-1", "--max_import_bytes must be positive"},
      {"history_revisions", "-1", "--history_revisions must not be negative"},
      {"max_lateness", "-1s", "--max_lateness must not be negative"},
      {"watch_progress", "0", "--watch_progress must be at least 1ms"},
      {"robot_memory_seconds", "9",
       "--robot_memory_seconds must not be less than --robot_online_seconds"},
      {"observation_age", "9m", "--observation_age must not be shorter than --max_lateness"},
  };
  for (const auto& c : cases) {
    const absl::FlagSaver saver;
    Set(c.flag, c.value);
    EXPECT_EQ(CheckError(), c.error);
  }
}

// The flags that errors name, in the sources of the rooms that a request reaches.
TEST(LimitFlagsTest, ErrorsNameFlagsThatExist) {
  const fs::path root(HYPERMAP_SOURCE_DIR);
  const std::regex named("--(max_[a-z_]+)");
  int num_named = 0;
  for (const char* const room : {"map", "server", "storage/interchange", "wire"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room)) {
      const std::string path = entry.path().string();
      if (!absl::EndsWith(path, ".cc") || absl::EndsWith(path, "_test.cc")) continue;
      std::ifstream file(path);
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      for (std::sregex_iterator it(text.begin(), text.end(), named), end; it != end; ++it) {
        EXPECT_NE(absl::FindCommandLineFlag((*it)[1].str()), nullptr) << path << ": " << (*it)[0];
        ++num_named;
      }
    }
  }
  EXPECT_GE(num_named, 10);
}

}  // namespace
}  // namespace hypermap::server
