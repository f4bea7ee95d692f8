#include "map/registration/grid_estimate.h"

#include <cmath>
#include <memory>
#include <optional>

#include "base/cancellation/cancellation.h"
#include "gtest/gtest.h"
#include "map/registration/layer_estimate.h"
#include "map/registration/testing/drawn_plan.h"

namespace hypermap::registration {
namespace {

using testing::Drawn;
using testing::EmptyRoom;
using testing::FurnishedRoom;
using testing::Plan;

const PlanarTransform kSourcePose(3.0, -7.0, 0.4);
const PlanarTransform kTargetPose(-5.0, 2.0, -2.2);
const PlanarTransform kTrueOfGrids = kTargetPose * kSourcePose.Inverse();

double OffsetFromTruth(const PlanarTransform& found) {
  return std::hypot(found.x() - kTrueOfGrids.x(), found.y() - kTrueOfGrids.y());
}

TEST(EstimateFromGridsTest, RoomIsLaidOverItselfWithAnyCells) {
  for (const double resolution_m : {0.04, 0.05, 0.06}) {
    SCOPED_TRACE(resolution_m);
    const auto estimate = EstimateFromGrids(*Drawn(FurnishedRoom, kSourcePose, resolution_m, 6.0),
                                            *Drawn(FurnishedRoom, kTargetPose, 0.05, 6.0));
    ASSERT_TRUE(estimate.ok()) << estimate.status();
    EXPECT_EQ(estimate->ambiguity, Ambiguity::kNone);
    EXPECT_LT(OffsetFromTruth(estimate->best.target_from_source), 0.03);
    EXPECT_NEAR(estimate->best.target_from_source.yaw(), kTrueOfGrids.yaw(), 0.005);
    EXPECT_GT(estimate->best.score, 0.9);
    EXPECT_GT(estimate->inlier_share, 0.95);
    ASSERT_NE(estimate->runner_up, std::nullopt);
    EXPECT_LT(estimate->runner_up->score, 0.7);
  }
}

TEST(EstimateFromGridsTest, LayersOfTwoMapsAreLaidOverEachOtherInTheirFrames) {
  auto source = std::make_shared<Snapshot>();
  source->layers["floor"] = Drawn(FurnishedRoom, kSourcePose, 0.05, 6.0);
  auto target = std::make_shared<Snapshot>();
  target->layers["floor"] = Drawn(FurnishedRoom, kTargetPose, 0.05, 6.0);
  const PlanarTransform site_from_map(20.0, 1.0, -0.5);
  ASSERT_TRUE(target->frames.Set({"site", "map", site_from_map}).ok());
  const auto estimate = EstimateFromLayers({source, "floor", ""}, {target, "floor", "site"});
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kNone);
  const PlanarTransform expected = site_from_map * kTrueOfGrids;
  const PlanarTransform& found = estimate->best.target_from_source;
  EXPECT_LT(std::hypot(found.x() - expected.x(), found.y() - expected.y()), 0.03);
  EXPECT_NEAR(found.yaw(), expected.yaw(), 0.005);
}

TEST(EstimateFromGridsTest, EmptyRoomCouldBeTurnedRound) {
  const auto estimate = EstimateFromGrids(*Drawn(EmptyRoom, kSourcePose, 0.05, 6.0),
                                          *Drawn(EmptyRoom, kTargetPose, 0.05, 6.0));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kRunnerUp);
  ASSERT_NE(estimate->runner_up, std::nullopt);
  EXPECT_NEAR(std::abs(std::remainder(estimate->runner_up->target_from_source.yaw() -
                                          estimate->best.target_from_source.yaw(),
                                      2.0 * M_PI)),
              M_PI, 0.01);
}

TEST(EstimateFromGridsTest, CorridorWithoutEndsIsAmbiguous) {
  const Plan corridor = [](const Point& p) -> std::optional<double> {
    if (std::abs(p.y) > 1.1 || std::abs(p.x) > 8.0) return std::nullopt;
    return std::abs(p.y) > 1.0 ? 1.0 : 0.0;
  };
  const Plan part = [&](const Point& p) -> std::optional<double> {
    return std::abs(p.x) > 4.0 ? std::nullopt : corridor(p);
  };
  const auto estimate = EstimateFromGrids(*Drawn(part, kSourcePose, 0.05, 9.0),
                                          *Drawn(corridor, kTargetPose, 0.05, 9.0));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_NE(estimate->ambiguity, Ambiguity::kNone);
}

TEST(EstimateFromGridsTest, RepeatedRoomsAreAmbiguous) {
  // Rooms of 3 m x 4 m along a corridor, with their doors at the left.
  const Plan hotel = [](const Point& p) -> std::optional<double> {
    if (std::abs(p.x) > 12.0 || p.y < -1.1 || p.y > 5.1) return std::nullopt;
    const double x = p.x - 3.0 * std::floor(p.x / 3.0);
    const bool is_outer = p.y < -1.0 || p.y > 5.0;
    const bool is_door = x > 0.4 && x < 1.2;
    const bool is_front = p.y > 1.0 && p.y < 1.1 && !is_door;
    return is_outer || is_front || (x < 0.1 && p.y > 1.0) ? 1.0 : 0.0;
  };
  const Plan part = [&](const Point& p) -> std::optional<double> {
    return std::abs(p.x) > 7.0 ? std::nullopt : hotel(p);
  };
  const auto estimate = EstimateFromGrids(*Drawn(part, kSourcePose, 0.05, 13.0),
                                          *Drawn(hotel, kTargetPose, 0.05, 13.0));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kRunnerUp) << estimate->runner_up->score;
}

// What is seen to be free tells the two ends of a room apart, even if all walls of one plan lie on
// walls of the other.
TEST(EstimateFromGridsTest, WallsOnFreeSpaceContradict) {
  const auto estimate = EstimateFromGrids(*Drawn(EmptyRoom, kSourcePose, 0.05, 6.0),
                                          *Drawn(FurnishedRoom, kTargetPose, 0.05, 6.0));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_LT(estimate->inlier_share, 0.95);
  EXPECT_NE(estimate->ambiguity, Ambiguity::kNone);
}

TEST(EstimateFromGridsTest, OtherRoomIsNoAnswer) {
  const Plan hall = [](const Point& p) -> std::optional<double> {
    const double r = std::hypot(p.x, p.y);
    if (r > 5.1) return std::nullopt;
    return r > 5.0 || std::hypot(p.x - 1.0, p.y) < 0.3 ? 1.0 : 0.0;
  };
  const auto estimate = EstimateFromGrids(*Drawn(FurnishedRoom, kSourcePose, 0.05, 6.0),
                                          *Drawn(hall, kTargetPose, 0.05, 6.0));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kLittleAgreement);
}

TEST(EstimateFromGridsTest, GridWithoutWallsIsRefused) {
  const Plan field = [](const Point&) { return std::optional<double>(0.0); };
  const auto grid = Drawn(field, kSourcePose, 0.05, 2.0);
  const auto room = Drawn(EmptyRoom, kTargetPose, 0.05, 6.0);
  const auto status = EstimateFromGrids(*grid, *room).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(), "source has no occupied cells");
  EXPECT_EQ(EstimateFromGrids(*room, *grid).status().message(), "target has no occupied cells");
}

TEST(EstimateFromGridsTest, CoarseCellsAreRefused) {
  const auto room = Drawn(EmptyRoom, kTargetPose, 0.05, 6.0);
  const auto coarse = Drawn(EmptyRoom, kTargetPose, 0.6, 6.0);
  EXPECT_EQ(EstimateFromGrids(*coarse, *room).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(EstimateFromGridsTest, GridWithTooManyKnownCellsIsRefused) {
  const auto room = Drawn(EmptyRoom, kTargetPose, 0.05, 6.0);
  GridWriter writer(room);
  ASSERT_TRUE(writer.Write({8000, 8001, 0, 1}, {0.0}).ok());
  ASSERT_TRUE(writer.Write({0, 1, 8000, 8001}, {0.0}).ok());
  const auto status = EstimateFromGrids(*room, *std::move(writer).Finish().layer).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(status.message().substr(0, 6), "target");
}

TEST(EstimateFromGridsTest, EndsWhenItIsCancelled) {
  const auto room = Drawn(FurnishedRoom, kTargetPose, 0.05, 6.0);
  for (int looks = 0; looks < 400; looks += 23) {
    int left = looks;
    Cancellation cancellation(
        [&] { return left-- > 0 ? absl::OkStatus() : absl::CancelledError("gone"); },
        absl::ZeroDuration());
    const ScopedCancellation here(&cancellation);
    EXPECT_EQ(EstimateFromGrids(*room, *room).status().code(), absl::StatusCode::kCancelled)
        << looks;
  }
}

}  // namespace
}  // namespace hypermap::registration
