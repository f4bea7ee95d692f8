#include "wire/access.h"

#include <gtest/gtest.h>

namespace hypermap::wire {
namespace {

TEST(RoleOnTheWire, ComesBack) {
  for (const access::Role role :
       {access::Role::kReader, access::Role::kRobot, access::Role::kEditor, access::Role::kAdmin}) {
    const auto decoded = DecodeRole("role", EncodeRole(role));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, role);
  }
}

TEST(RoleOnTheWire, IsNamedIfItIsMissingOrUnknown) {
  EXPECT_EQ(DecodeRole("role", v1::ROLE_UNSPECIFIED).status(),
            absl::InvalidArgumentError("role is missing"));
  EXPECT_EQ(DecodeRole("role", static_cast<v1::Role>(9)).status(),
            absl::InvalidArgumentError("role is not known: 9"));
}

}  // namespace
}  // namespace hypermap::wire
