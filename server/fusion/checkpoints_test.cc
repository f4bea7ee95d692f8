#include "server/fusion/checkpoints.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/time/time.h"
#include "server/fusion/testing/tally_strategy.h"

namespace hypermap::server {
namespace {

std::shared_ptr<const TallyStrategy> Strategy() { return std::make_shared<TallyStrategy>("tally"); }

storage::LogKey KeyAt(int64_t second) { return {{absl::FromUnixSeconds(second), "a", second}, 0}; }

// A state of one track, which shares nothing with others.
FoldPoint PointAt(int64_t position) {
  auto state = std::make_shared<TallyStrategy::State>();
  state->by_label["cup"] = {};
  return {KeyAt(position), std::move(state), position};
}

// The most entries that are folded again, for each one that must be, when the log changes anywhere
// within the newest `depth` entries.
double WorstRatio(const std::vector<int64_t>& positions, int64_t end, int64_t depth) {
  double worst = 1.0;
  for (int64_t back = 1; back <= depth; ++back) {
    const auto after = std::lower_bound(positions.begin(), positions.end(), end - back);
    const int64_t from = after == positions.begin() ? 0 : *std::prev(after);
    // Checkpoints are 16 entries apart at best.
    worst = std::max(worst, static_cast<double>(end - from) / static_cast<double>(back + 16));
  }
  return worst;
}

TEST(CheckpointsTest, LateObservationsCostLittleMoreThanTheirLateness) {
  for (const size_t most : {size_t{8}, size_t{40}, size_t{128}}) {
    std::vector<int64_t> positions;
    double worst = 1.0;
    for (int64_t end = 16; end <= 64'000; end += 16) {
      positions.push_back(end);
      while (positions.size() > most) {
        const size_t dropped = MostDispensable(positions, positions.back());
        ASSERT_GT(dropped, 0u);
        ASSERT_LT(dropped + 1, positions.size());
        positions.erase(positions.begin() + static_cast<std::ptrdiff_t>(dropped));
      }
      if (end % 6400 == 0) worst = std::max(worst, WorstRatio(positions, end, end));
    }
    // 64,000 entries are 12 doublings of 16.
    EXPECT_LE(worst, most == 8 ? 8.0 : most == 40 ? 1.7 : 1.2) << most;
  }
}

TEST(CheckpointsTest, TheNewestBeforeAKeyIsFound) {
  Checkpoints checkpoints(Strategy(), absl::InfiniteDuration(), 1 << 20);
  EXPECT_FALSE(checkpoints.Newest());
  for (const int64_t position : {10, 20, 30}) checkpoints.Add(PointAt(position));
  EXPECT_FALSE(checkpoints.Before(KeyAt(10)));
  EXPECT_EQ(checkpoints.Before(KeyAt(11))->position, 10);
  EXPECT_EQ(checkpoints.Before(KeyAt(30))->position, 20);
  EXPECT_EQ(checkpoints.Newest()->position, 30);
  checkpoints.DropFrom(KeyAt(20));
  EXPECT_EQ(checkpoints.Newest()->position, 10);
}

TEST(CheckpointsTest, OldOnesAreDroppedButForOne) {
  Checkpoints checkpoints(Strategy(), absl::Seconds(100), 1 << 20);
  for (const int64_t position : {10, 20, 30, 125}) checkpoints.Add(PointAt(position));
  EXPECT_FALSE(checkpoints.Before(KeyAt(20)));
  EXPECT_EQ(checkpoints.Before(KeyAt(30))->position, 20);
}

TEST(CheckpointsTest, TakeTheirBytesAndNoMore) {
  Checkpoints checkpoints(Strategy(), absl::InfiniteDuration(), 5 * TallyStrategy::kBytesOfTrack);
  for (int64_t position = 10; position <= 200; position += 10) checkpoints.Add(PointAt(position));
  EXPECT_EQ(checkpoints.size(), 6u);
  EXPECT_EQ(checkpoints.Bytes(nullptr), 6 * TallyStrategy::kBytesOfTrack);
  EXPECT_EQ(checkpoints.Newest()->position, 200);
  EXPECT_EQ(checkpoints.Before(KeyAt(200))->position, 190);
  Checkpoints none(Strategy(), absl::InfiniteDuration(), 0);
  for (const int64_t position : {10, 20}) none.Add(PointAt(position));
  EXPECT_EQ(none.size(), 1u);
  EXPECT_EQ(none.Newest()->position, 20);
}

TEST(CheckpointsTest, ThoseOfAnotherFoldAreAppended) {
  Checkpoints checkpoints(Strategy(), absl::InfiniteDuration(), 1 << 20);
  for (const int64_t position : {10, 20}) checkpoints.Add(PointAt(position));
  Checkpoints other(Strategy(), absl::InfiniteDuration(), 1 << 20);
  for (const int64_t second : {10, 20, 30, 40}) {
    FoldPoint point = PointAt(second);
    point.position = second - 15;
    other.Add(point);
  }
  const int64_t shift = checkpoints.Append(other);
  EXPECT_EQ(checkpoints.Newest()->key, KeyAt(40));
  EXPECT_EQ(checkpoints.Newest()->position, 25 + shift);
  EXPECT_GT(checkpoints.Before(KeyAt(40))->position, 20);
  EXPECT_EQ(checkpoints.Before(KeyAt(30))->position, 20);
}

}  // namespace
}  // namespace hypermap::server
