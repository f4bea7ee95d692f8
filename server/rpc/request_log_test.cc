#include "server/rpc/request_log.h"

#include <gtest/gtest.h>

namespace hypermap::server {
namespace {

using logging::Level;

TEST(RequestLogTest, FaultsOfTheServerAreLouderThanMistakesOfCallers) {
  EXPECT_EQ(LevelOf(absl::StatusCode::kInternal), Level::kError);
  EXPECT_EQ(LevelOf(absl::StatusCode::kDataLoss), Level::kError);
  EXPECT_EQ(LevelOf(absl::StatusCode::kPermissionDenied), Level::kWarning);
  EXPECT_EQ(LevelOf(absl::StatusCode::kUnauthenticated), Level::kWarning);
  EXPECT_EQ(LevelOf(absl::StatusCode::kInvalidArgument), Level::kInfo);
  EXPECT_EQ(LevelOf(absl::StatusCode::kResourceExhausted), Level::kInfo);
  EXPECT_EQ(LevelOf(absl::StatusCode::kDeadlineExceeded), Level::kInfo);
  EXPECT_EQ(LevelOf(absl::StatusCode::kCancelled), Level::kDebug);
  EXPECT_EQ(LevelOf(absl::StatusCode::kOk), Level::kDebug);
}

}  // namespace
}  // namespace hypermap::server
