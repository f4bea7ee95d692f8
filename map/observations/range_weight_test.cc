#include "map/observations/range_weight.h"

#include "gtest/gtest.h"

namespace hypermap {
namespace {

TEST(RangeWeightTest, FallsWithTheFourthPowerOfTheRange) {
  EXPECT_EQ(RangeWeight(0.0), 1.0);
  EXPECT_EQ(RangeWeight(1.8), 0.5);
  EXPECT_DOUBLE_EQ(RangeWeight(3.6), 1.0 / 17.0);
  EXPECT_DOUBLE_EQ(RangeWeight(18.0), 1.0 / 10001.0);
}

TEST(RangeWeightTest, IsProportionalToTheWeightAtRangeZero) {
  EXPECT_EQ(RangeWeight(0.0, 0.6), 0.6);
  EXPECT_EQ(RangeWeight(1.8, 0.6), 0.3);
}

}  // namespace
}  // namespace hypermap
