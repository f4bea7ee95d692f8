#include "ingest/sources/trajectory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

namespace hypermap::ingest {
namespace {

constexpr double kHalf = 0.70710678118654752;

absl::Time At(double seconds) {
  return absl::UnixEpoch() + absl::Seconds(1500000000) + absl::Seconds(seconds);
}

// A camera at (0, 0, 1) without rotation, and 0.25 s later at (2, 0, 1), turned by 90 degrees about
// z.
constexpr char kTurn[] =
    "# t tx ty tz qx qy qz qw\n"
    "1500000000.00 0 0 1 0 0 0 1\n"
    "1500000000.25 2 0 1 0 0 0.70710678 0.70710678  # a comment\n";

TEST(TrajectoryTest, ASampleIsTakenAsItStands) {
  const auto trajectory = Trajectory::Parse(kTurn);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  const auto pose = trajectory->At(At(0.25), {});
  ASSERT_TRUE(pose.ok()) << pose.status();
  EXPECT_EQ(pose->translation(), Eigen::Vector3d(2, 0, 1));
  EXPECT_TRUE(pose->linear().col(0).isApprox(Eigen::Vector3d(0, 1, 0), 1e-6));
  EXPECT_NEAR(pose->linear().determinant(), 1.0, 1e-12);
}

TEST(TrajectoryTest, ACommentMayStateTheSigma) {
  EXPECT_EQ(Trajectory::Parse(kTurn)->pose_sigma(), std::nullopt);
  const std::string header = "# taken on a Monday\n#  pose_sigma: 0.1,0.2,0.3\r\n";
  const auto trajectory = Trajectory::Parse(header + kTurn);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->pose_sigma(), (PoseSigma{0.1, 0.2, 0.3}));
  EXPECT_EQ(trajectory->bad_lines(), 0);
  const auto wrong = Trajectory::Parse(std::string("# pose_sigma: 0.1\n") + kTurn);
  EXPECT_TRUE(absl::IsInvalidArgument(wrong.status())) << wrong.status();
}

TEST(TrajectoryTest, HalfWayIsHalfTheMoveAndHalfTheTurn) {
  const auto trajectory = Trajectory::Parse(kTurn);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  const auto pose = trajectory->At(At(0.125), {});
  ASSERT_TRUE(pose.ok()) << pose.status();
  EXPECT_TRUE(pose->translation().isApprox(Eigen::Vector3d(1, 0, 1), 1e-12));
  EXPECT_TRUE(pose->linear().col(0).isApprox(Eigen::Vector3d(kHalf, kHalf, 0), 1e-6));
}

TEST(TrajectoryTest, TheOrderOfLinesDoesNotMatter) {
  const auto trajectory = Trajectory::Parse(
      "1500000000.25 2 0 1 0 0 0 1\n"
      "1500000000.00 0 0 1 0 0 0 1\n");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_TRUE(trajectory->At(At(0.125), {})->translation().isApprox(Eigen::Vector3d(1, 0, 1)));
}

TEST(TrajectoryTest, BeyondTheEndsThereIsAPoseForAMomentOnly) {
  const auto trajectory = Trajectory::Parse(kTurn);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  EXPECT_EQ(trajectory->At(At(-0.01), {})->translation(), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(trajectory->At(At(0.26), {})->translation(), Eigen::Vector3d(2, 0, 1));
  EXPECT_EQ(trajectory->At(At(-0.03), {}).status().message(), "outside of the trajectory");
  EXPECT_EQ(trajectory->At(At(0.28), {}).status().message(), "outside of the trajectory");
}

TEST(TrajectoryTest, NothingIsInterpolatedAcrossAGap) {
  const auto trajectory = Trajectory::Parse(kTurn);
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  const TrajectoryLimits limits{.max_gap = absl::Milliseconds(200)};
  EXPECT_EQ(trajectory->At(At(0.125), limits).status().message(), "gap in the trajectory");
  EXPECT_TRUE(trajectory->At(At(0.25), limits).ok());
}

TEST(TrajectoryTest, NothingIsInterpolatedFromABadPose) {
  for (const char* bad :
       {"nan 0 1 0 0 0 1", "0 0 inf 0 0 0 1", "0 0 1 0 0 0 0", "0 0 1 0 0 0 1.1", "0 0 1", "a"}) {
    const auto trajectory = Trajectory::Parse(std::string(kTurn) + "1500000000.5 " + bad +
                                              "\n1500000000.75 2 0 1 0 0 0 1\n");
    ASSERT_TRUE(trajectory.ok()) << trajectory.status();
    EXPECT_EQ(trajectory->bad_lines(), 1) << bad;
    EXPECT_TRUE(trajectory->At(At(0.2), {}).ok());
    EXPECT_EQ(trajectory->At(At(0.5), {}).status().message(), "bad pose") << bad;
    EXPECT_EQ(trajectory->At(At(0.6), {}).status().message(), "bad pose") << bad;
    EXPECT_TRUE(trajectory->At(At(0.75), {}).ok());
  }
}

TEST(TrajectoryTest, ARoundedQuaternionIsMadeUnitLength) {
  const auto trajectory = Trajectory::Parse("1500000000 0 0 1 0 0 0.705 0.705\n");
  ASSERT_TRUE(trajectory.ok()) << trajectory.status();
  const auto pose = trajectory->At(At(0), {});
  EXPECT_TRUE((pose->linear() * pose->linear().transpose()).isIdentity(1e-12));
}

TEST(TrajectoryTest, AFileWithoutPosesIsRefused) {
  EXPECT_TRUE(absl::IsInvalidArgument(Trajectory::Parse("").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(Trajectory::Parse("# nothing\nx y z\n").status()));
}

}  // namespace
}  // namespace hypermap::ingest
