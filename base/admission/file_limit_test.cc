#include "base/admission/file_limit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

namespace hypermap::admission {
namespace {

using ::testing::HasSubstr;

TEST(FileLimitTest, A1SoftLimitIsRaisedToTheHardOne) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit lowered = before;
  lowered.rlim_cur = 100;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &lowered), 0);
  const int64_t limit = RaiseFileLimit();
  rlimit raised{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &raised), 0);
  EXPECT_GT(limit, 100);
  EXPECT_EQ(static_cast<int64_t>(raised.rlim_cur), limit);
  setrlimit(RLIMIT_NOFILE, &before);
}

TEST(FileLimitTest, ConnectionsLeaveFilesForOtherUses) {
  const auto limits = LimitConnections({0, 0}, 1024, 104);
  ASSERT_TRUE(limits.ok()) << limits.status();
  EXPECT_EQ(limits->max_connections, 690);
  EXPECT_EQ(limits->max_connections_per_address, 516);
  const auto asked = LimitConnections({100, 10}, 1024, 104);
  ASSERT_TRUE(asked.ok()) << asked.status();
  EXPECT_EQ(asked->max_connections, 100);
  EXPECT_EQ(asked->max_connections_per_address, 10);
}

TEST(FileLimitTest, A1TooFewFilesAreSaid) {
  const absl::Status few = LimitConnections({0, 0}, 128, 240).status();
  EXPECT_EQ(few.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(few.message()), HasSubstr("(ulimit -n) is 128, but 240 are needed"));
  const absl::Status many = LimitConnections({5'000, 0}, 1024, 104).status();
  EXPECT_EQ(many.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(many.message()), HasSubstr("--max_connections=5000"));
}

}  // namespace
}  // namespace hypermap::admission
