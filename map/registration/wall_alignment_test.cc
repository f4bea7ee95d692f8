#include "map/registration/wall_alignment.h"

#include <cmath>

#include "gtest/gtest.h"
#include "map/registration/copy_refinement.h"
#include "map/registration/pose_search.h"
#include "map/registration/testing/drawn_plan.h"

namespace hypermap::registration {
namespace {

using testing::Drawn;
using testing::FurnishedRoom;

const PlanarTransform kTurnedRoom(6.0, 1.0, 0.7);

WallMap RoomAt(const PlanarTransform& pose, double resolution_m) {
  return *WallMap::Make(*Drawn(FurnishedRoom, pose, resolution_m, 6.0), "room");
}

PlanarTransform Moved(const PlanarTransform& pose, double x, double y, double yaw) {
  return PlanarTransform(pose.x() + x, pose.y() + y, pose.yaw() + yaw);
}

class WallAlignmentTest : public ::testing::Test {
 protected:
  const WallMap source_ = RoomAt(PlanarTransform(), 0.05);
  const WallMap target_ = RoomAt(kTurnedRoom, 0.04);
  const WallAlignment alignment_{source_, target_, 5000};
};

TEST_F(WallAlignmentTest, PosesNearTheTruthAreRefinedToIt) {
  for (const auto& [x, y, yaw] :
       {std::tuple(0.0, 0.0, 0.0), std::tuple(0.2, -0.1, 0.03), std::tuple(-0.15, -0.2, -0.04)}) {
    const PlanarTransform refined = alignment_.Refined(Moved(kTurnedRoom, x, y, yaw), 0.5, 0.1);
    EXPECT_LT(alignment_.Distance(refined, kTurnedRoom), 0.015) << x << " " << y << " " << yaw;
  }
}

TEST_F(WallAlignmentTest, AgreementFallsAwayFromTheTruth) {
  const WallAgreement at_truth = alignment_.AgreementAt(kTurnedRoom);
  EXPECT_GT(at_truth.score, 0.9);
  EXPECT_GT(at_truth.inlier_share, 0.99);
  const WallAgreement beside = alignment_.AgreementAt(Moved(kTurnedRoom, 0.3, 0.3, 0.0));
  EXPECT_LT(beside.score, 0.3);
  EXPECT_LT(beside.inlier_share, 0.7);
  // Far away there is nothing to compare.
  EXPECT_EQ(alignment_.AgreementAt(Moved(kTurnedRoom, 100.0, 0.0, 0.0)).score, 0.0);
}

TEST_F(WallAlignmentTest, DistanceIsThatOfTheWalls) {
  EXPECT_NEAR(alignment_.Distance(kTurnedRoom, Moved(kTurnedRoom, 0.3, 0.4, 0.0)), 0.5, 1e-9);
  double squares = 0.0;
  const PlanarTransform turned = Moved(kTurnedRoom, 0.1, 0.2, 0.8);
  for (const Eigen::Vector2d& wall : source_.walls()) {
    const Point a = kTurnedRoom * Point{wall.x(), wall.y()};
    const Point b = turned * Point{wall.x(), wall.y()};
    squares += (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y);
  }
  EXPECT_NEAR(alignment_.Distance(kTurnedRoom, turned),
              std::sqrt(squares / static_cast<double>(source_.walls().size())), 1e-6);
}

TEST_F(WallAlignmentTest, SearchFindsTheTruthFirst) {
  for (const double yaw : {-3.0, -1.6, 0.0, 0.4, 2.1}) {
    const PlanarTransform truth(-20.0, 35.0, yaw);
    const WallMap target = RoomAt(truth, 0.05);
    const auto found = SearchPoses(source_, target, 10);
    ASSERT_TRUE(found.ok()) << found.status();
    ASSERT_EQ(found->size(), 10u);
    EXPECT_LT(alignment_.Distance(found->front().target_from_source, truth), 0.3) << yaw;
    EXPECT_GT(found->front().score, (*found)[1].score);
  }
}

// Sub-cell errors of distances vanish for a copy, and a grid of the same room that is no copy stays
// where it was.
TEST_F(WallAlignmentTest, CopyIsRefinedCellByCell) {
  const PlanarTransform start = Moved(PlanarTransform(), 0.012, -0.01, 0.002);
  const auto refined = RefinedAsCopy(source_, source_, start);
  ASSERT_TRUE(refined.ok()) << refined.status();
  EXPECT_LT(alignment_.Distance(*refined, PlanarTransform()), 0.005);
  const WallMap other = *WallMap::Make(
      *Drawn(
          [](const Point& p) {
            const bool has_shelf = Box{{-3.5, 1.0}, {-1.5, 1.5}}.Covers(p);
            return has_shelf ? std::optional<double>(1.0) : FurnishedRoom({p.x * 1.03, p.y});
          },
          PlanarTransform(), 0.05, 6.0),
      "other");
  const auto kept = RefinedAsCopy(source_, other, start);
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(*kept, start);
}

}  // namespace
}  // namespace hypermap::registration
