#include "client_libs/ros2/bridge/problem_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace hypermap::ros2 {
namespace {

TEST(ProblemLogTest, EachKindIsCountedAndLoggedOnceInAWhile) {
  ::testing::internal::CaptureStdout();
  ProblemLog log;
  for (int i = 0; i < 1000; ++i) log.Note("a message is skipped", absl::InvalidArgumentError("no"));
  log.Note("frames are dropped", absl::ResourceExhaustedError("full"), 5);
  const std::string lines = ::testing::internal::GetCapturedStdout();
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 2) << lines;
  EXPECT_EQ(log.CountOf("a message is skipped"), 1000);
  EXPECT_EQ(log.CountOf("frames are dropped"), 5);
  EXPECT_EQ(log.CountOf("other"), 0);
}

}  // namespace
}  // namespace hypermap::ros2
