#include "map/robots/robot_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/support/not_finite.h"

namespace hypermap {
namespace {

using ::hypermap::testing::kInf;
using ::hypermap::testing::kNan;
using ::testing::HasSubstr;

RobotReport SomeReport() {
  RobotReport report;
  report.robot = "r1";
  report.stamp = absl::FromUnixSeconds(1000);
  report.frame_from_robot = PlanarTransform(1, 2, 0.5);
  report.covariance = Eigen::Vector3d(0.04, 0.01, 0.001).asDiagonal();
  report.map_revision = 7;
  report.battery = 0.8;
  report.state = "driving";
  report.fields = {{"task", "12"}};
  return report;
}

TEST(RobotReportTest, IsValidUpToItsBounds) {
  RobotReport report = SomeReport();
  EXPECT_TRUE(Validate(report).ok());
  report.robot = std::string(128, 'r');
  report.frame_id = std::string(63, 'f');
  report.battery = 1.0;
  report.state = std::string(256, 's');
  report.fields = {{"long", std::string(4092, 'v')}};
  EXPECT_TRUE(Validate(report).ok()) << Validate(report);
}

TEST(RobotReportTest, NamesTheFieldThatIsWrong) {
  const auto problem = [](auto change) {
    RobotReport report = SomeReport();
    change(report);
    const absl::Status status = Validate(report);
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    return std::string(status.message());
  };
  EXPECT_EQ(problem([](auto& r) { r.robot = ""; }), "robot must have 1 to 128 bytes");
  EXPECT_EQ(problem([](auto& r) { r.robot = std::string(129, 'r'); }),
            "robot must have 1 to 128 bytes");
  EXPECT_EQ(problem([](auto& r) { r.robot = "a\nb"; }), "robot has control characters");
  EXPECT_EQ(problem([](auto& r) { r.frame_id = std::string(64, 'f'); }),
            "frame_id has more than 63 bytes");
  EXPECT_THAT(problem([](auto& r) { r.frame_from_robot = PlanarTransform(2e9, 0, 0); }),
              HasSubstr("pose: x or y is more than"));
  EXPECT_EQ(problem([](auto& r) { r.covariance->coeffRef(0, 1) = 1; }),
            "covariance must be finite, symmetric and not negative");
  EXPECT_THAT(problem([](auto& r) { r.covariance->coeffRef(2, 2) = -1; }), HasSubstr("covariance"));
  EXPECT_THAT(problem([](auto& r) { r.covariance->coeffRef(2, 2) = kInf; }),
              HasSubstr("covariance"));
  EXPECT_EQ(problem([](auto& r) { r.map_revision = -1; }), "map_revision is negative");
  EXPECT_EQ(problem([](auto& r) { r.battery = 1.01; }), "battery must be from 0 to 1");
  EXPECT_EQ(problem([](auto& r) { r.battery = kNan; }), "battery must be from 0 to 1");
  EXPECT_EQ(problem([](auto& r) { r.state = std::string(257, 's'); }),
            "state has more than 256 bytes");
  EXPECT_EQ(problem([](auto& r) { r.fields["long"] = std::string(4092, 'v'); }),
            "fields have more than 4096 bytes");
  EXPECT_EQ(problem([](auto& r) {
              for (int i = 0; i < 32; ++i) r.fields[std::to_string(i)] = "";
            }),
            "fields are more than 32");
}

TEST(RobotReportTest, TurnsPoseAndCovarianceIntoAnotherFrame) {
  const PlanarTransform map_from_dock(10, 0, std::numbers::pi / 2);
  const RobotReport moved = Transformed(SomeReport(), map_from_dock, "map");
  EXPECT_EQ(moved.frame_id, "map");
  EXPECT_NEAR(moved.frame_from_robot.x(), 8, 1e-12);
  EXPECT_NEAR(moved.frame_from_robot.y(), 1, 1e-12);
  EXPECT_NEAR(moved.frame_from_robot.yaw(), 0.5 + std::numbers::pi / 2, 1e-12);
  // What was uncertain along x is now along y.
  const Eigen::Matrix3d expected = Eigen::Vector3d(0.01, 0.04, 0.001).asDiagonal();
  EXPECT_TRUE(moved.covariance->isApprox(expected, 1e-12)) << *moved.covariance;
  EXPECT_EQ(moved.state, "driving");
}

}  // namespace
}  // namespace hypermap
