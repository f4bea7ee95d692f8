// migrate as whole command lines. What it copies is tested in storage/transfer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "client_libs/cli/testing/run.h"
#include "storage/geopackage/geopackage_store.h"
#include "tests/support/temporary_folder.h"

namespace hypermap::cli {
namespace {

using storage::MapStore;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kDiffers = 1;
constexpr int kInUse = 3;

class MigrateCommandTest : public ::testing::Test {
 protected:
  static std::unique_ptr<MapStore> Open(const testing::TemporaryFolder& folder) {
    auto store = storage::OpenGeoPackageStore(folder.path());
    EXPECT_TRUE(store.ok()) << store.status();
    return store.ok() ? *std::move(store) : nullptr;
  }
  void SetUp() override {
    const std::unique_ptr<MapStore> store = Open(from_);
    for (const char* name : {"lab", "site"}) {
      ASSERT_TRUE(store->Create({.name = name, .frame_id = "map"}).ok());
    }
  }
  Outcome Migrate(const Args& more = {}) const {
    Args args = {"migrate", "--from", from_.path(), "--to", to_.path()};
    args.insert(args.end(), more.begin(), more.end());
    return RunCommand(args);
  }

  const testing::TemporaryFolder from_;
  const testing::TemporaryFolder to_;
};

TEST_F(MigrateCommandTest, MapsAreCopiedAndShown) {
  const Outcome first = Migrate({"--map", "site"});
  EXPECT_EQ(first.exit_code, kExitOk) << first.err;
  EXPECT_THAT(first.out, HasSubstr("site          0        0             0  equal    copied"));
  EXPECT_THAT(first.out, Not(HasSubstr("lab")));
  const Outcome all = Migrate({"--json"});
  EXPECT_EQ(all.exit_code, kExitOk) << all.err;
  EXPECT_THAT(all.out, HasSubstr(R"("state":"moved")"));
  EXPECT_THAT(all.out, HasSubstr(R"("state":"there_before")"));
  EXPECT_EQ(Open(to_)->List()->size(), 2u);
}

TEST_F(MigrateCommandTest, DryRunAndVerificationCopyNothing) {
  const Outcome dry = Migrate({"--dry_run"});
  EXPECT_EQ(dry.exit_code, kExitOk) << dry.err;
  EXPECT_THAT(dry.out, HasSubstr("not copied"));
  const Outcome missing = Migrate({"--verify_only"});
  EXPECT_EQ(missing.exit_code, kDiffers);
  EXPECT_THAT(missing.out, HasSubstr("there is no copy"));
  EXPECT_THAT(to_.Names(), IsEmpty());
  EXPECT_EQ(Migrate().exit_code, kExitOk);
  EXPECT_EQ(Migrate({"--verify_only"}).exit_code, kExitOk);
}

TEST_F(MigrateCommandTest, MapsOfAServerStayUnfinished) {
  const std::unique_ptr<MapStore> server = Open(from_);
  const Outcome outcome = Migrate();
  EXPECT_EQ(outcome.exit_code, kInUse) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("unfinished: a server has the map open"));
}

TEST_F(MigrateCommandTest, MapThatCannotBeCopiedIsToldBesideTheOthers) {
  ASSERT_TRUE(Open(to_)->Create({.name = "lab", .frame_id = "map"}).ok());
  const Outcome outcome = Migrate();
  EXPECT_EQ(outcome.exit_code, kDiffers);
  EXPECT_THAT(outcome.out, HasSubstr("there is a map lab of another incarnation"));
  EXPECT_THAT(outcome.out, HasSubstr("copied"));
}

TEST_F(MigrateCommandTest, StoreThatCannotBeOpenedIsAnError) {
  const Outcome outcome = RunCommand({"migrate", "--from", from_ / "none", "--to", to_.path()});
  EXPECT_EQ(outcome.exit_code, kExitError);
  EXPECT_THAT(outcome.err, HasSubstr("no folder"));
  EXPECT_THAT(outcome.err, Not(HasSubstr("server")));
}

}  // namespace
}  // namespace hypermap::cli
