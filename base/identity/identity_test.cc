#include "base/identity/identity.h"

#include <gtest/gtest.h>

#include "base/identity/role.h"

namespace hypermap::access {
namespace {

TEST(RoleTest, EachHasItsName) {
  for (const Role role : {Role::kReader, Role::kRobot, Role::kEditor, Role::kAdmin}) {
    EXPECT_EQ(ParseRole(RoleName(role)).value(), role);
  }
  EXPECT_EQ(ParseRole("root").status().message(),
            "role \"root\" is not reader, robot, editor or admin");
}

TEST(IdentityTest, PatternsAreThoseOfAShell) {
  EXPECT_TRUE(MatchesOne({"*"}, "office"));
  EXPECT_TRUE(MatchesOne({"hall-?", "office"}, "hall-3"));
  EXPECT_TRUE(MatchesOne({"hall-[1-3]"}, "hall-3"));
  EXPECT_FALSE(MatchesOne({"hall-[1-3]"}, "hall-4"));
  EXPECT_FALSE(MatchesOne({"hall"}, "hall-1"));
  EXPECT_FALSE(MatchesOne({"hall-*"}, "hall"));
  EXPECT_FALSE(MatchesOne({}, "hall"));
}

TEST(IdentityTest, RobotsActUnderTheirOwnNames) {
  const Identity robot{"robot-7", Role::kRobot, {"*"}, {"robot-7-*"}};
  EXPECT_TRUE(MayActAs(robot, "robot-7"));
  EXPECT_TRUE(MayActAs(robot, "robot-7-arm"));
  EXPECT_FALSE(MayActAs(robot, "robot-8"));
  EXPECT_TRUE(MayActAs({"anna", Role::kEditor, {"*"}, {}}, "robot-8"));
}

}  // namespace
}  // namespace hypermap::access
