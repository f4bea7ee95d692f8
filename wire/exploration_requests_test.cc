#include "wire/exploration_requests.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "wire/geometry.h"

namespace hypermap::wire {
namespace {

ExplorationStart SomeStart() {
  ExplorationStart start;
  start.area = Polygon::FromBox({{0, 0}, {4, 2}});
  start.frame_id = "dock";
  start.occupancy_layer = "walls";
  start.exploration_layer = "seen";
  start.explored_rule = CellRule::kTouched;
  start.robot_radius_m = 0.3;
  start.range_m = 5.5;
  start.min_gain_cells = 9;
  start.request_id = "once";
  return start;
}

TEST(ExplorationStartOnTheWire, ComesBack) {
  const ExplorationStart start = SomeStart();
  v1::StartExplorationRequest message;
  EncodeStart(start, &message);
  const auto decoded = DecodeStart(message, {});
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->area, start.area);
  EXPECT_EQ(decoded->frame_id, start.frame_id);
  EXPECT_EQ(decoded->occupancy_layer, start.occupancy_layer);
  EXPECT_EQ(decoded->exploration_layer, start.exploration_layer);
  EXPECT_EQ(decoded->explored_rule, start.explored_rule);
  EXPECT_EQ(decoded->robot_radius_m, start.robot_radius_m);
  EXPECT_EQ(decoded->range_m, start.range_m);
  EXPECT_EQ(decoded->min_gain_cells, start.min_gain_cells);
  EXPECT_EQ(decoded->request_id, start.request_id);
}

TEST(ExplorationStartOnTheWire, HasDefaultsAndNeedsAnArea) {
  v1::StartExplorationRequest message;
  EXPECT_EQ(DecodeStart(message, {}).status(), absl::InvalidArgumentError("area is missing"));
  EncodePolygon(SomeStart().area, message.mutable_area());
  const auto decoded = DecodeStart(message, {});
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->explored_rule, CellRule::kCentre);
  EXPECT_EQ(decoded->robot_radius_m, 0.0);
  EXPECT_EQ(decoded->range_m, kDefaultRange_m);
  EXPECT_EQ(decoded->min_gain_cells, kDefaultMinGainCells);
}

TEST(ExplorationStartOnTheWire, A4AreaCountsAgainstTheLimitOfQuestions) {
  v1::StartExplorationRequest message;
  EncodeStart(SomeStart(), &message);
  Limits limits;
  limits.max_question_vertices = 2;
  const absl::Status status = DecodeStart(message, limits).status();
  EXPECT_TRUE(absl::IsResourceExhausted(status)) << status;
  EXPECT_NE(status.message().find("--max_question_vertices is 2"), std::string::npos) << status;
}

TEST(GoalClaimOnTheWire, ComesBack) {
  const GoalClaim claim{7, "r1", {1.5, -2.5}, "dock", absl::Seconds(90), ""};
  v1::ClaimGoalRequest message;
  EncodeClaim(claim, &message);
  const auto decoded = DecodeClaim(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->exploration_id, claim.exploration_id);
  EXPECT_EQ(decoded->robot, claim.robot);
  EXPECT_EQ(decoded->place, claim.place);
  EXPECT_EQ(decoded->frame_id, claim.frame_id);
  EXPECT_EQ(decoded->lease, claim.lease);
}

TEST(GoalClaimOnTheWire, HasADefaultLeaseAndNeedsAFinitePose) {
  v1::ClaimGoalRequest message;
  EXPECT_EQ(DecodeClaim(message).status(), absl::InvalidArgumentError("pose is missing"));
  EncodePose(PlanarTransform(1, 2, 3), message.mutable_pose());
  EXPECT_EQ(DecodeClaim(message)->lease, kDefaultLease);
  message.mutable_pose()->set_x(std::numeric_limits<double>::infinity());
  EXPECT_EQ(DecodeClaim(message).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(GoalRenewalOnTheWire, ComesBack) {
  v1::RenewGoalRequest message;
  EncodeRenewal({"r1", 12, absl::Milliseconds(1500), ""}, &message);
  const auto decoded = DecodeRenewal(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->robot, "r1");
  EXPECT_EQ(decoded->goal_id, 12);
  EXPECT_EQ(decoded->lease, absl::Milliseconds(1500));
  message.clear_lease();
  EXPECT_EQ(DecodeRenewal(message)->lease, kDefaultLease);
}

TEST(GoalReleaseOnTheWire, ComesBackAndNeedsAnOutcome) {
  v1::ReleaseGoalRequest message;
  EncodeRelease({"r1", 12, GoalOutcome::kAbandoned, ""}, &message);
  const auto decoded = DecodeRelease(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->robot, "r1");
  EXPECT_EQ(decoded->goal_id, 12);
  EXPECT_EQ(decoded->outcome, GoalOutcome::kAbandoned);
  message.clear_outcome();
  EXPECT_EQ(DecodeRelease(message).status(), absl::InvalidArgumentError("outcome is missing"));
}

}  // namespace
}  // namespace hypermap::wire
