#include "client_libs/ros2/bridge/time_synchronizer.h"

#include <gtest/gtest.h>

#include <string>

namespace hypermap::ros2 {
namespace {

using Synchronizer = TimeSynchronizer<std::string, std::string>;

absl::Time StampOf(int64_t milliseconds) { return absl::FromUnixMillis(milliseconds); }

// The pair as "FIRST SECOND"; empty if there is none.
std::string Text(const std::optional<std::pair<std::string, std::string>>& pair) {
  return pair ? pair->first + " " + pair->second : "";
}

TEST(TimeSynchronizerTest, MessagesArePairedWithTheNearestThatWaits) {
  Synchronizer synchronizer(10, absl::Milliseconds(5));
  EXPECT_EQ(Text(synchronizer.AddFirst(StampOf(100), "depth100")), "");
  EXPECT_EQ(Text(synchronizer.AddFirst(StampOf(103), "depth103")), "");
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(104), "boxes104")), "depth103 boxes104");
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(105), "boxes105")), "depth100 boxes105");
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(200), "boxes200")), "");
  EXPECT_EQ(Text(synchronizer.AddFirst(StampOf(206), "depth206")), "") << "beyond the slop";
  EXPECT_EQ(Text(synchronizer.AddFirst(StampOf(205), "depth205")), "depth205 boxes200");
  EXPECT_EQ(synchronizer.num_first_unpaired(), 0);
}

TEST(TimeSynchronizerTest, OfTwoThatAreEquallyNearTheFirstToArriveIsTaken) {
  Synchronizer synchronizer(10, absl::Milliseconds(5));
  synchronizer.AddFirst(StampOf(104), "late");
  synchronizer.AddFirst(StampOf(100), "early");
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(102), "boxes")), "late boxes");
}

TEST(TimeSynchronizerTest, AFullQueueLosesItsOldestMessage) {
  Synchronizer synchronizer(2, absl::ZeroDuration());
  for (const int stamp : {3, 1, 2, 2}) {
    EXPECT_EQ(Text(synchronizer.AddFirst(StampOf(stamp), std::to_string(stamp))), "");
  }
  EXPECT_EQ(synchronizer.num_first_unpaired(), 2) << "1, and the first 2";
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(1), "one")), "");
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(3), "three")), "3 three");
  EXPECT_EQ(synchronizer.num_second_unpaired(), 0);
}

TEST(TimeSynchronizerTest, AClockThatIsSetBackBeginsAnew) {
  Synchronizer synchronizer(2, absl::ZeroDuration());
  synchronizer.AddFirst(StampOf(100'000), "a");
  synchronizer.AddFirst(StampOf(100'100), "b");
  EXPECT_EQ(Text(synchronizer.AddFirst(StampOf(1000), "c")), "");
  EXPECT_EQ(Text(synchronizer.AddSecond(StampOf(1000), "d")), "c d");
  EXPECT_EQ(synchronizer.num_first_unpaired(), 2);
}

}  // namespace
}  // namespace hypermap::ros2
