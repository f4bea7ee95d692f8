// The marks that tie commit times to the time that passed.
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "storage/conformance/contract.h"
#include "storage/conformance/testing/time_mark.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;

class TimeMarkContract : public MapContract {
 protected:
  std::vector<TimeMark> Marks() {
    auto marks = map_.stored->TimeMarks();
    EXPECT_TRUE(marks.ok()) << marks.status();
    return marks.ok() ? *std::move(marks) : std::vector<TimeMark>();
  }
};

HYPERMAP_CONFORMANCE_SUITE(TimeMarkContract);

TEST_P(TimeMarkContract, C1MarksAreReadAsTheyWereAddedAlsoAfterARestart) {
  EXPECT_TRUE(Marks().empty());
  for (const int64_t seconds : {10, 20}) {
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(seconds), absl::ZeroDuration()).ok());
  }
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(10), MarkAt(20)));
  Reopen();
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(10), MarkAt(20)));
}

TEST_P(TimeMarkContract, C1TheNewestMarkBeforeTheBoundIsKept) {
  for (int64_t seconds = 10; seconds <= 50; seconds += 10) {
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(seconds), absl::Seconds(10)).ok());
  }
  EXPECT_EQ(Marks().size(), 5u);
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(60), absl::Seconds(35)).ok());
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(30), MarkAt(40), MarkAt(50), MarkAt(60)));
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(70), absl::Hours(1)).ok());
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(70)));
}

TEST_P(TimeMarkContract, MarksAreKeptToTheNanosecond) {
  constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
  TimeMark first;
  first.commit_time = absl::FromUnixNanos(-kMost);
  first.passed = absl::Nanoseconds(-kMost);
  first.lived = absl::Nanoseconds(-kMost);
  first.server_time = absl::FromUnixNanos(kMost - 1);
  first.boot_id = "";
  first.since_boot = absl::Nanoseconds(-1);
  TimeMark second;
  second.revision = std::numeric_limits<Revision>::max();
  second.commit_time = absl::FromUnixNanos(kMost - 1);
  second.passed = absl::Nanoseconds(kMost - 1);
  second.lived = absl::Nanoseconds(kMost - 1);
  second.server_time = absl::FromUnixNanos(-kMost);
  second.boot_id = "it's 100%_\\ \U0001f916";
  second.since_boot = absl::Nanoseconds(kMost - 1);
  for (const TimeMark& mark : {first, second}) {
    ASSERT_TRUE(map_.stored->AddTimeMark(mark, -absl::InfiniteDuration()).ok());
  }
  Reopen();
  EXPECT_THAT(Marks(), ElementsAre(first, second));
}

TEST_P(TimeMarkContract, AllButTheNewestMarkAreForgottenBeforeTheEndOfTime) {
  for (const int64_t seconds : {10, 20, 30}) {
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(seconds), absl::ZeroDuration()).ok());
  }
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(40), absl::InfiniteDuration()).ok());
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(40)));
}

TEST_P(TimeMarkContract, MarksOfOneMomentAreKeptInTheirOrder) {
  std::vector<TimeMark> marks;
  for (const char* boot_id : {"b", "a", "c"}) {
    TimeMark mark = MarkAt(10);
    mark.boot_id = boot_id;
    ASSERT_TRUE(map_.stored->AddTimeMark(mark, absl::Seconds(10)).ok());
    marks.push_back(mark);
  }
  EXPECT_EQ(Marks(), marks);
  Reopen();
  EXPECT_EQ(Marks(), marks);
}

TEST_P(TimeMarkContract, MarksChangeNothingElse) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}}, "r");
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
  EXPECT_EQ((*map_.stored->OpenHistory())->Kept()->newest, 1);
  ExpectReopensTheSame();
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(10)));
}

}  // namespace
}  // namespace hypermap::storage
