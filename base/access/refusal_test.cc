#include "base/access/refusal.h"

#include <gtest/gtest.h>

namespace hypermap::access {
namespace {

TEST(RefusalTest, ReasonIsReadBack) {
  for (size_t i = 0; i < kNumReasons; ++i) {
    const auto reason = static_cast<Reason>(i);
    EXPECT_EQ(ReasonOf(Refusal(reason, "because")), reason) << ReasonName(reason);
  }
}

TEST(RefusalTest, CodeTellsCredentialsFromRights) {
  EXPECT_TRUE(absl::IsUnauthenticated(Refusal(Reason::kNoCredentials, "")));
  EXPECT_TRUE(absl::IsUnauthenticated(Refusal(Reason::kUnknownCertificate, "")));
  EXPECT_TRUE(absl::IsPermissionDenied(Refusal(Reason::kRole, "")));
  EXPECT_TRUE(absl::IsPermissionDenied(Refusal(Reason::kChanged, "")));
}

TEST(RefusalTest, OtherErrorsHaveNone) {
  EXPECT_EQ(ReasonOf(absl::OkStatus()), std::nullopt);
  EXPECT_EQ(ReasonOf(absl::PermissionDeniedError("of the disk")), std::nullopt);
  EXPECT_EQ(ReasonOf(absl::NotFoundError("map")), std::nullopt);
}

}  // namespace
}  // namespace hypermap::access
