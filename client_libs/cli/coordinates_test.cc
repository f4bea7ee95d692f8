#include "client_libs/cli/coordinates.h"

#include <gtest/gtest.h>

namespace hypermap::cli {
namespace {

TEST(ParsePointTest, TakesAnySignAndIsExact) {
  const absl::StatusOr<Point> point = ParsePoint("-2.7500000000000004,+.1");
  ASSERT_TRUE(point.ok()) << point.status();
  EXPECT_EQ(*point, (Point{-2.7500000000000004, 0.1}));
}

TEST(ParsePointTest, RefusesEverythingElse) {
  for (const char* text :
       {"", "1", "1,", ",1", "1,2,3", "1;2", "a,b", "nan,1", "1,inf", "1,1e999", "1,2,", "1,x,2"}) {
    EXPECT_EQ(ParsePoint(text).status().code(), absl::StatusCode::kInvalidArgument) << text;
  }
}

TEST(ParsePoseTest, IsThreeNumbers) {
  EXPECT_EQ(*ParsePose("20,0,1.75"), PlanarTransform(20, 0, 1.75));
  EXPECT_FALSE(ParsePose("20,0").ok());
}

TEST(ParsePolygonTest, IsWhatTheVerticesEnclose) {
  EXPECT_EQ(*ParsePolygon({"0,0", "0,1", "1,1", "1,0"}),
            *Polygon::Make({{0, 0}, {0, 1}, {1, 1}, {1, 0}}));
  EXPECT_EQ(ParsePolygon({"0,0", "1,1", "1,0", "0,1"}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace hypermap::cli
