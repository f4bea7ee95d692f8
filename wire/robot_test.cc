#include "wire/robot.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/not_finite.h"

namespace hypermap::wire {
namespace {

RobotReport SomeReport() {
  RobotReport report;
  report.robot = "r1";
  report.stamp = absl::FromUnixMillis(1'700'000'000'250);
  report.frame_id = "odom";
  report.frame_from_robot = PlanarTransform(1.5, -2.5, 0.25);
  report.covariance.emplace();
  *report.covariance << 0.01, 0.002, 0.0, 0.002, 0.02, 1e-4, 0.0, 1e-4, 0.001;
  report.map_revision = 0;
  report.map_incarnation = 99;
  report.battery = 0.0;
  report.state = "charging";
  report.fields = {{"task", "12"}, {"floor", "2"}};
  return report;
}

RobotPresence SomePresence() {
  return {SomeReport(), /*in_map_frame=*/true, /*online=*/true,
          absl::FromUnixMillis(1'700'000'001'500)};
}

RobotsAt SomeAt() { return {7, 99, "map", absl::FromUnixMillis(1'700'000'002'000)}; }

TEST(RobotReportOnTheWire, ComesBack) {
  v1::RobotReport message;
  EncodeReport(SomeReport(), &message);
  const auto decoded = DecodeReport("report", message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(*decoded, SomeReport());
}

TEST(RobotReportOnTheWire, WhatIsNotKnownIsAbsent) {
  RobotReport report;
  report.robot = "r1";
  report.stamp = absl::FromUnixSeconds(1);
  v1::RobotReport message;
  EncodeReport(report, &message);
  EXPECT_FALSE(message.has_map_revision());
  EXPECT_FALSE(message.has_battery());
  EXPECT_TRUE(message.covariance().empty());
  EXPECT_EQ(*DecodeReport("report", message), report);
}

TEST(RobotReportOnTheWire, ErrorsNameTheField) {
  const auto problem = [](auto change) {
    v1::RobotReport message;
    EncodeReport(SomeReport(), &message);
    change(message);
    const auto decoded = DecodeReport("report", message);
    EXPECT_TRUE(absl::IsInvalidArgument(decoded.status()));
    return std::string(decoded.status().message());
  };
  EXPECT_EQ(problem([](auto& m) { m.clear_stamp(); }), "report.stamp is missing");
  EXPECT_EQ(problem([](auto& m) { m.clear_pose(); }), "report.pose is missing");
  EXPECT_EQ(problem([](auto& m) { m.mutable_pose()->set_x(hypermap::testing::kNan); }),
            "report.pose is not finite");
  EXPECT_EQ(problem([](auto& m) { m.add_covariance(1); }),
            "report.covariance must have 9 numbers or none");
}

TEST(RobotListOnTheWire, ComesBack) {
  v1::ListRobotsResponse message;
  EncodeRobotsAt(SomeAt(), &message);
  EncodePresence(SomePresence(), message.add_robots());
  const auto decoded = DecodeRobotList(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->at, SomeAt());
  EXPECT_EQ(decoded->robots, std::vector<RobotPresence>{SomePresence()});
}

TEST(RobotChangesOnTheWire, ComeBack) {
  v1::WatchRobotsResponse message;
  EncodeRobotsAt(SomeAt(), &message);
  EncodePresence(SomePresence(), message.add_robots());
  message.add_forgotten("r2");
  message.set_reset(true);
  message.set_more(true);
  const auto decoded = DecodeRobotChanges(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->at, SomeAt());
  EXPECT_EQ(decoded->robots, std::vector<RobotPresence>{SomePresence()});
  EXPECT_EQ(decoded->forgotten, std::vector<std::string>{"r2"});
  EXPECT_TRUE(decoded->reset);
  EXPECT_TRUE(decoded->more);
}

TEST(ReportAnswerOnTheWire, TellsWhetherTheReportWasAccepted) {
  for (const bool accepted : {false, true}) {
    v1::ReportResponse message;
    message.set_revision(3);
    message.set_incarnation(99);
    message.set_outcome(EncodeReportOutcome(accepted));
    const auto decoded = DecodeReportAnswer(message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->accepted, accepted);
    EXPECT_EQ(decoded->revision, 3);
    EXPECT_EQ(decoded->incarnation, 99u);
  }
  EXPECT_EQ(DecodeReportAnswer({}).status(), absl::InvalidArgumentError("outcome is missing"));
}

}  // namespace
}  // namespace hypermap::wire
