#include "server/config_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "absl/flags/flag.h"
#include "absl/flags/reflection.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "tests/support/temporary_folder.h"

// Flags of this test, which lies below server/ like those of hypermapd.
ABSL_FLAG(std::string, test_name, "nobody", "");
ABSL_FLAG(int, test_number, 1, "");
ABSL_FLAG(absl::Duration, test_time, absl::Seconds(1), "");
ABSL_FLAG(bool, test_switch, false, "");

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string ErrorOf(const std::string& yaml) {
  const absl::StatusOr<std::vector<FlagValue>> values = ParseConfig(yaml);
  const absl::Status status = values.ok() ? SetFlags(*values) : values.status();
  EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
  return std::string(status.message());
}

TEST(ConfigFileTest, SetsFlags) {
  const absl::FlagSaver saver;
  const auto values = ParseConfig(
      "# a comment\n"
      "test_name: \"two words\"\n"
      "test_number: 7\n"
      "test_time: 90s\n"
      "test_switch: true\n");
  ASSERT_TRUE(values.ok()) << values.status();
  ASSERT_EQ(SetFlags(*values), absl::OkStatus());
  EXPECT_EQ(absl::GetFlag(FLAGS_test_name), "two words");
  EXPECT_EQ(absl::GetFlag(FLAGS_test_number), 7);
  EXPECT_EQ(absl::GetFlag(FLAGS_test_time), absl::Seconds(90));
  EXPECT_TRUE(absl::GetFlag(FLAGS_test_switch));
}

TEST(ConfigFileTest, AnEmptyFileSetsNothing) {
  for (const char* yaml : {"", "\n", "# only a comment\n"}) {
    const auto values = ParseConfig(yaml);
    ASSERT_TRUE(values.ok()) << values.status();
    EXPECT_THAT(*values, IsEmpty());
  }
}

TEST(ConfigFileTest, ErrorsNameTheLine) {
  EXPECT_EQ(ErrorOf("test_name: a\ntest_nmae: b\n"),
            "line 2: \"test_nmae\" is no flag of hypermapd");
  EXPECT_EQ(ErrorOf("test_name: a\n\ntest_name: b\n"), "line 3: \"test_name\" occurs twice");
  EXPECT_EQ(ErrorOf("test_name: [a, b]\n"), "line 1: \"test_name\" has no single value");
  EXPECT_EQ(ErrorOf("- test_name\n"), "line 1: not a mapping of flags to values");
  EXPECT_THAT(ErrorOf("test_name: [a\n"), HasSubstr("line"));
}

TEST(ConfigFileTest, FlagsOfLibrariesAndOfTheFileItselfAreNone) {
  EXPECT_THAT(ErrorOf("flagfile: other\n"), HasSubstr("is no flag of hypermapd"));
  EXPECT_THAT(ErrorOf("config: other.yaml\n"), HasSubstr("is no flag of hypermapd"));
  EXPECT_THAT(ErrorOf("--test_name: a\n"), HasSubstr("is no flag of hypermapd"));
}

TEST(ConfigFileTest, ValuesThatTheFlagCantHaveAreRefusedByName) {
  const absl::FlagSaver saver;
  EXPECT_THAT(ErrorOf("test_number: many\n"), ::testing::StartsWith("test_number: "));
  EXPECT_THAT(ErrorOf("test_time: soon\n"), ::testing::StartsWith("test_time: "));
}

TEST(ConfigFileTest, FindsTheFileOnTheCommandLine) {
  EXPECT_EQ(ConfigOnCommandLine({"--config=a.yaml"}), "a.yaml");
  EXPECT_EQ(ConfigOnCommandLine({"--threads=3", "--config", "a.yaml", "--insecure"}), "a.yaml");
  EXPECT_EQ(ConfigOnCommandLine({"-config=a.yaml", "--config=b.yaml"}), "b.yaml");
  EXPECT_EQ(ConfigOnCommandLine({"--configuration=a.yaml", "config=b.yaml"}), "");
  EXPECT_EQ(ConfigOnCommandLine({"--", "--config=a.yaml"}), "");
  EXPECT_EQ(ConfigOnCommandLine({"--config"}), "");
  EXPECT_EQ(ConfigOnCommandLine({}), "");
}

TEST(ConfigFileTest, ErrorsOfAFileNameIt) {
  const absl::FlagSaver saver;
  const hypermap::testing::TemporaryFolder folder;
  const std::string path = folder.path() + "/hypermapd.yaml";
  std::ofstream(path) << "test_number: 8\n";
  EXPECT_EQ(ReadConfigFile(path), absl::OkStatus());
  EXPECT_EQ(absl::GetFlag(FLAGS_test_number), 8);
  std::ofstream(path) << "unknown: 8\n";
  const absl::Status status = ReadConfigFile(path);
  EXPECT_TRUE(absl::IsInvalidArgument(status));
  EXPECT_THAT(std::string(status.message()), HasSubstr(path + ": line 1: "));
  EXPECT_FALSE(ReadConfigFile(folder.path() + "/missing.yaml").ok());
}

}  // namespace
}  // namespace hypermap::server
