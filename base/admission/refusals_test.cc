#include "base/admission/refusals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::admission {
namespace {

using ::testing::SizeIs;

class RefusalsTest : public ::testing::Test {
 protected:
  std::vector<Refusals::Line> lines_;
  Refusals refusals_{[this](const Refusals::Line& line) { lines_.push_back(line); }};
};

TEST_F(RefusalsTest, AreCountedByTheirFlagAndLoggedOnceInAWhile) {
  for (int i = 0; i < 3; ++i) refusals_.Count(TryLater("there are 5, --max_calls is 5"));
  refusals_.Count(absl::ResourceExhaustedError("--max_edits"));
  refusals_.Count(absl::ResourceExhaustedError("the disk is full"));
  EXPECT_EQ(refusals_.NumOf("--max_calls"), 3);
  EXPECT_EQ(refusals_.NumOf("--max_edits"), 1);
  EXPECT_EQ(refusals_.NumOf("a limit"), 1);
  EXPECT_EQ(refusals_.NumOf("--max_queue"), 0);
  ASSERT_THAT(lines_, SizeIs(3));
  EXPECT_EQ(lines_[0].flag, "--max_calls");
  EXPECT_EQ(lines_[0].count, 1);
  EXPECT_EQ(lines_[0].message, "there are 5, --max_calls is 5");
}

TEST_F(RefusalsTest, OtherErrorsAreNotCounted) {
  refusals_.Count(absl::OkStatus());
  refusals_.Count(absl::InvalidArgumentError("--max_calls"));
  EXPECT_EQ(refusals_.NumOf("--max_calls"), 0);
  EXPECT_THAT(lines_, SizeIs(0));
}

TEST_F(RefusalsTest, OnlyWhatPassesByItselfIsOverload) {
  EXPECT_FALSE(refusals_.IsOverloaded(absl::Hours(1)));
  refusals_.Count(absl::ResourceExhaustedError("a polygon is larger than --max_vertices"));
  EXPECT_FALSE(refusals_.IsOverloaded(absl::Hours(1)));
  refusals_.Count(TryLater("--max_queue"));
  EXPECT_TRUE(refusals_.IsOverloaded(absl::Hours(1)));
  EXPECT_FALSE(refusals_.IsOverloaded(absl::ZeroDuration()));
}

TEST_F(RefusalsTest, TextOfClientsDoesNotFillTheTable) {
  for (int i = 0; i < 1000; ++i) {
    refusals_.Count(absl::ResourceExhaustedError(absl::StrCat("layer \"--x", i, "\" is full")));
  }
  EXPECT_GT(refusals_.NumOf("a limit"), 900);
}

TEST(TryLaterTest, IsAResourceExhaustedThatIsTold) {
  const absl::Status status = TryLater("--max_queue is 2");
  EXPECT_TRUE(absl::IsResourceExhausted(status));
  EXPECT_TRUE(IsTryLater(status));
  EXPECT_FALSE(IsTryLater(absl::ResourceExhaustedError("--max_queue is 2")));
  EXPECT_FALSE(IsTryLater(absl::OkStatus()));
}

}  // namespace
}  // namespace hypermap::admission
