#include "storage/geopackage/time_mark_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "storage/geopackage/testing/map.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A mark after `seconds` of the map's life, during which its commit times ran twice as fast.
TimeMark MarkAt(int64_t seconds) {
  TimeMark mark;
  mark.revision = seconds;
  mark.commit_time = absl::FromUnixSeconds(2 * seconds);
  mark.passed = absl::Seconds(seconds);
  mark.lived = absl::Seconds(seconds) + absl::Nanoseconds(1);
  mark.server_time = absl::FromUnixSeconds(-seconds);
  mark.boot_id = "boot";
  mark.since_boot = absl::Nanoseconds(seconds);
  return mark;
}

class TimeMarkTableTest : public ::testing::Test {
 protected:
  TimeMarkTableTest() : store_(OpenStore(folder_.path())), map_(CreateMap(*store_, "site")) {}

  void Reopen() {
    map_.stored.reset();
    auto opened = store_->Open("site");
    ASSERT_TRUE(opened.ok()) << opened.status();
    map_.stored = *std::move(opened);
  }
  std::vector<TimeMark> Marks() {
    auto marks = map_.stored->TimeMarks();
    EXPECT_TRUE(marks.ok()) << marks.status();
    return marks.ok() ? *std::move(marks) : std::vector<TimeMark>();
  }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
  EditedMap map_;
};

TEST_F(TimeMarkTableTest, C1MarksAreReadAsTheyWereAddedAlsoAfterARestart) {
  EXPECT_TRUE(Marks().empty());
  for (const int64_t seconds : {10, 20}) {
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(seconds), absl::ZeroDuration()).ok());
  }
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(10), MarkAt(20)));
  Reopen();
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(10), MarkAt(20)));
}

TEST_F(TimeMarkTableTest, C1TheNewestMarkBeforeTheBoundIsKept) {
  for (int64_t seconds = 10; seconds <= 50; seconds += 10) {
    ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(seconds), absl::Seconds(10)).ok());
  }
  EXPECT_EQ(Marks().size(), 5u);
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(60), absl::Seconds(35)).ok());
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(30), MarkAt(40), MarkAt(50), MarkAt(60)));
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(70), absl::Hours(1)).ok());
  EXPECT_THAT(Marks(), ElementsAre(MarkAt(70)));
}

TEST_F(TimeMarkTableTest, C1TimeThatGoesBackIsDamage) {
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(10), absl::ZeroDuration()).ok());
  ASSERT_TRUE(map_.stored->AddTimeMark(MarkAt(20), absl::ZeroDuration()).ok());
  ASSERT_TRUE(Connect(folder_ / "site.gpkg")
                  ->Execute("UPDATE hypermap_time_marks SET passed_ns = 1 WHERE revision = 20")
                  .ok());
  const absl::Status status = map_.stored->TimeMarks().status();
  EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("hypermap_time_marks"));
}

}  // namespace
}  // namespace hypermap::storage
