#include "map/fusion/repeated_view.h"

#include <cmath>

#include "gtest/gtest.h"

namespace hypermap::fusion {
namespace {

const absl::Time kStamp = absl::FromUnixSeconds(1'700'000'000);

View LookingAlong(double yaw) {
  return {"a", kStamp, {1.0, 2.0, 1.2}, {std::cos(yaw), std::sin(yaw), 0.0}, 2, {3.0, 2.0}};
}

TEST(RecentViewsTest, TheSameViewOfAnotherRobotIsRepeated) {
  RecentViews views;
  EXPECT_FALSE(views.Repeats(LookingAlong(0.0), 0.02));
  views.Add(LookingAlong(0.0));
  EXPECT_FALSE(views.Repeats(LookingAlong(0.0), 0.02));  // The robot stands still.
  View other = LookingAlong(0.01);
  other.robot = "b";
  other.position.x() += 0.01;
  other.stamp += absl::Milliseconds(20);
  EXPECT_TRUE(views.Repeats(other, 0.02));
  View turned = LookingAlong(0.02);
  turned.robot = "b";
  EXPECT_FALSE(views.Repeats(turned, 0.02));
  View beside = other;
  beside.position.y() += 0.03;
  EXPECT_FALSE(views.Repeats(beside, 0.02));
  View later = other;
  later.stamp += absl::Milliseconds(200);
  EXPECT_FALSE(views.Repeats(later, 0.02));
  View of_more = other;
  of_more.num_detections = 3;
  EXPECT_FALSE(views.Repeats(of_more, 0.02));
  View of_others = other;
  of_others.centre.x += 0.2;
  EXPECT_FALSE(views.Repeats(of_others, 0.02));
}

TEST(RecentViewsTest, NothingIsRepeatedWithinNoDistance) {
  RecentViews views;
  views.Add(LookingAlong(0.0));
  View other = LookingAlong(0.0);
  other.robot = "b";
  EXPECT_TRUE(views.Repeats(other, 0.02));
  EXPECT_FALSE(views.Repeats(other, 0.0));
}

TEST(RecentViewsTest, KeepsAFewNewOnes) {
  RecentViews views;
  for (int i = 0; i < 100; ++i) views.Add(LookingAlong(0.1 * i));
  EXPECT_EQ(views.views().size(), RecentViews::kMost);
  EXPECT_EQ(views.views().back().axis, LookingAlong(9.9).axis);
  View later = LookingAlong(0.0);
  later.stamp += absl::Seconds(1);
  views.Add(later);
  EXPECT_EQ(views.views().size(), 1u);
}

}  // namespace
}  // namespace hypermap::fusion
