#include "client_libs/flags/connection_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace hypermap::client {
namespace {

using ::hypermap::testing::TemporaryFolder;
using ::testing::HasSubstr;

// `args` in reverse order, as CLI11 expects them.
ConnectionFlags Parse(std::vector<std::string> args) {
  CLI::App app;
  ConnectionFlags flags;
  AddConnectionFlags(app, flags);
  app.parse(std::move(args));
  return flags;
}

TEST(ConnectionFlagsTest, TheTokensFileMayComeFromTheEnvironment) {
  setenv("HYPERMAP_TOKEN_FILE", "/run/token", 1);
  const ConnectionFlags from_environment = Parse({});
  const ConnectionFlags from_flag = Parse({"--token_file=mine"});
  unsetenv("HYPERMAP_TOKEN_FILE");
  EXPECT_EQ(from_environment.token_file, "/run/token");
  EXPECT_EQ(from_flag.token_file, "mine");
  EXPECT_EQ(Parse({}).token_file, "");
}

TEST(ConnectionFlagsTest, NoFlagTakesTheTokenItself) {
  EXPECT_THROW(Parse({"--token=secret"}), CLI::ExtrasError);
}

TEST(ConnectionFlagsTest, FilesThatCannotBeUsedAreErrorsAtOnce) {
  const TemporaryFolder folder;
  const absl::Status gone = MakeClient(Parse({"--tls_ca=" + folder / "gone.pem"}), {}).status();
  EXPECT_TRUE(absl::IsNotFound(gone)) << gone;
  EXPECT_THAT(std::string(gone.message()), HasSubstr("gone.pem"));

  folder.Write("robot.pem", "");
  const absl::Status alone = MakeClient(Parse({"--tls_cert=" + folder / "robot.pem"}), {}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(alone)) << alone;
  EXPECT_THAT(std::string(alone.message()), HasSubstr("one of them is missing"));
}

}  // namespace
}  // namespace hypermap::client
