#include "server/auth/caller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

namespace hypermap::server {
namespace {

using access::Identity;
using access::Role;
using ::testing::AllOf;
using ::testing::HasSubstr;

Caller CallerOf(Identity identity) {
  Caller caller;
  caller.identity = std::make_shared<const Identity>(std::move(identity));
  return caller;
}

TEST(CallerTest, WithoutIdentitiesEverybodyMayDoEverything) {
  const Caller caller;
  for (const RpcInfo& row : AllRpcs()) EXPECT_TRUE(caller.CheckRpc(row.rpc).ok()) << row.method;
  EXPECT_TRUE(caller.CheckMap("office").ok());
  EXPECT_TRUE(caller.CheckAllMaps().ok());
  EXPECT_TRUE(caller.CheckRobot("r1").ok());
}

TEST(CallerTest, MayDoWhatItsRoleAndLesserOnesMay) {
  const Role roles[] = {Role::kReader, Role::kRobot, Role::kEditor, Role::kAdmin};
  for (const RpcInfo& row : AllRpcs()) {
    for (const Role role : roles) {
      const absl::Status status = CallerOf({"anna", role}).CheckRpc(row.rpc);
      EXPECT_EQ(status.ok(), !row.least || role >= *row.least) << row.method;
      EXPECT_TRUE(status.ok() || absl::IsPermissionDenied(status));
    }
  }
}

TEST(CallerTest, ErrorsNameTheIdentityItsRoleAndTheOneThatIsNeeded) {
  const absl::Status status = CallerOf({"anna", Role::kReader}).CheckRpc(Rpc::kDeleteMap);
  EXPECT_THAT(std::string(status.message()), AllOf(HasSubstr("anna"), HasSubstr("reader"),
                                                   HasSubstr("DeleteMap"), HasSubstr("admin")));
}

TEST(CallerTest, HasItsRoleForTheMapsOfItsPatternsOnly) {
  const Caller caller = CallerOf({"anna", Role::kAdmin, {"hall-*", "yard"}});
  EXPECT_TRUE(caller.CheckMap("hall-2").ok());
  EXPECT_TRUE(caller.CheckMap("yard").ok());
  EXPECT_TRUE(absl::IsPermissionDenied(caller.CheckMap("yard-2")));
  EXPECT_FALSE(caller.MaySee("office"));
  EXPECT_TRUE(absl::IsPermissionDenied(caller.CheckAllMaps()));
  EXPECT_TRUE(CallerOf({"anna", Role::kAdmin, {"yard", "*"}}).CheckAllMaps().ok());
}

TEST(CallerTest, RobotsActInTheirOwnNames) {
  const Caller robot = CallerOf({"r1", Role::kRobot, {"*"}, {"r1-*"}});
  EXPECT_TRUE(robot.CheckRobot("r1").ok());
  EXPECT_TRUE(robot.CheckRobot("r1-arm").ok());
  EXPECT_TRUE(absl::IsPermissionDenied(robot.CheckRobot("r2")));
  EXPECT_TRUE(CallerOf({"anna", Role::kEditor}).CheckRobot("r2").ok());
}

}  // namespace
}  // namespace hypermap::server
