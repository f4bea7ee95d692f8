#include "storage/postgres/time_marks.h"

#include <limits>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "storage/postgres/testing/written_map.h"

namespace hypermap::storage::postgres {
namespace {

using ::testing::HasSubstr;

using TimeMarksTest = WrittenMapTest;

TimeMark MarkOf(int i) {
  return {.revision = i,
          .commit_time = absl::FromUnixNanos(1'700'000'000'123'456'789 + i),
          .passed = absl::Seconds(i),
          .lived = absl::Seconds(i),
          .server_time = absl::FromUnixSeconds(i),
          .boot_id = "boot",
          .since_boot = absl::Nanoseconds(i)};
}

std::vector<Revision> RevisionsOf(Connection& connection, const OwnedMap& owned) {
  const auto marks = ReadTimeMarks(connection, owned.map());
  EXPECT_TRUE(marks.ok()) << marks.status();
  std::vector<Revision> revisions;
  for (const TimeMark& mark : *marks) revisions.push_back(mark.revision);
  return revisions;
}

TEST_F(TimeMarksTest, EachMapForgetsItsOwn) {
  const std::unique_ptr<OwnedMap> other = AddMap("other");
  for (int i = 1; i <= 4; ++i) {
    ASSERT_TRUE(AddTimeMark(*owned_, MarkOf(i), absl::Seconds(3)).ok());
    ASSERT_TRUE(AddTimeMark(*other, MarkOf(i), absl::ZeroDuration()).ok());
  }
  EXPECT_THAT(RevisionsOf(*connection_, *owned_), ::testing::ElementsAre(2, 3, 4));
  EXPECT_THAT(RevisionsOf(*connection_, *other), ::testing::ElementsAre(1, 2, 3, 4));
}

TEST_F(TimeMarksTest, TimesBeyondTheColumnsAreClamped) {
  TimeMark mark = MarkOf(1);
  mark.commit_time = absl::InfinitePast();
  mark.since_boot = absl::InfiniteDuration();
  ASSERT_TRUE(AddTimeMark(*owned_, mark, absl::InfiniteDuration()).ok());
  EXPECT_EQ(ReadTimeMarks(*connection_, owned_->map())->front().commit_time,
            absl::FromUnixNanos(std::numeric_limits<int64_t>::min()));
}

TEST_F(TimeMarksTest, DamageIsNamed) {
  for (const char* column : {"revision", "commit_time_ns", "passed_ns", "lived_ns"}) {
    Run("DELETE FROM hypermap.time_marks WHERE map = $1");
    for (int i = 1; i <= 2; ++i) {
      ASSERT_TRUE(AddTimeMark(*owned_, MarkOf(i), absl::ZeroDuration()).ok());
    }
    Run(absl::StrCat("UPDATE hypermap.time_marks SET ", column,
                     " = -1 WHERE map = $1 AND number = 2"));
    const absl::Status status = ReadTimeMarks(*connection_, owned_->map()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << column;
    EXPECT_THAT(std::string(status.message()), HasSubstr("hypermap.time_marks, number 2: "));
  }
}

}  // namespace
}  // namespace hypermap::storage::postgres
