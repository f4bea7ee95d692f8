#include "server/services/robot_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "base/time/testing/manual_clock.h"
#include "hypermap/v1/robot_service.grpc.pb.h"
#include "server/services/testing/test_server.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

using ::testing::HasSubstr;

// A map "site" with the frame "dock", 10 m along the map's x axis, and a clock that stands still.
class RobotServiceTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const FrameTransform dock{"map", "dock", PlanarTransform(10, 0, 0)};
    server_.MakeMap("site", {{SetTransform{dock}}});
  }

  SessionOptions Options() {
    SessionOptions options;
    options.limits.max_robots = 2;
    options.clock = clock_;
    return options;
  }

  v1::ReportRequest ReportAt(const std::string& robot, double x) {
    v1::ReportRequest request;
    request.set_map("site");
    request.mutable_report()->set_robot(robot);
    wire::EncodeTime(clock_->Now(), request.mutable_report()->mutable_stamp());
    request.mutable_report()->mutable_pose()->set_x(x);
    return request;
  }
  grpc::Status Report(const v1::ReportRequest& request, v1::ReportResponse* response) {
    grpc::ClientContext context;
    return server_.robots->Report(&context, request, response);
  }
  void Report(const v1::ReportRequest& request) {
    v1::ReportResponse response;
    const grpc::Status status = Report(request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    ASSERT_EQ(response.outcome(), v1::REPORT_OUTCOME_ACCEPTED);
  }
  v1::ListRobotsResponse List() {
    grpc::ClientContext context;
    v1::ListRobotsRequest request;
    request.set_map("site");
    v1::ListRobotsResponse response;
    EXPECT_TRUE(server_.robots->ListRobots(&context, request, &response).ok());
    return response;
  }
  std::unique_ptr<grpc::ClientReader<v1::WatchRobotsResponse>> Watch(grpc::ClientContext* context) {
    v1::WatchRobotsRequest request;
    request.set_map("site");
    return server_.robots->WatchRobots(context, request);
  }

  ManualClock machine_;
  std::shared_ptr<ServerClock> clock_ = std::make_shared<ServerClock>(&machine_);
  TestServer server_{{}, 1 << 20, Options()};
};

TEST_F(RobotServiceTest, ListsRobotsInTheMapsFrame) {
  v1::ReportRequest request = ReportAt("b", 1);
  request.mutable_report()->set_frame_id("dock");
  request.mutable_report()->set_battery(0.5);
  (*request.mutable_report()->mutable_fields())["task"] = "12";
  v1::ReportResponse reported;
  ASSERT_TRUE(Report(request, &reported).ok());
  EXPECT_EQ(reported.map(), "site");
  EXPECT_EQ(reported.revision(), 1);
  EXPECT_NE(reported.incarnation(), 0u);
  request = ReportAt("a", 2);
  request.mutable_report()->set_frame_id("odom");
  Report(request);

  const v1::ListRobotsResponse list = List();
  EXPECT_EQ(list.map(), "site");
  EXPECT_EQ(list.revision(), 1);
  EXPECT_EQ(list.incarnation(), reported.incarnation());
  EXPECT_EQ(list.frame_id(), "map");
  EXPECT_EQ(wire::DecodeTime(list.time()), clock_->Now());
  ASSERT_EQ(list.robots_size(), 2);
  EXPECT_EQ(list.robots(0).report().robot(), "a");
  EXPECT_FALSE(list.robots(0).in_map_frame());
  EXPECT_EQ(list.robots(0).report().frame_id(), "odom");
  EXPECT_EQ(list.robots(0).report().pose().x(), 2);
  EXPECT_TRUE(list.robots(1).in_map_frame());
  EXPECT_EQ(list.robots(1).report().frame_id(), "map");
  EXPECT_EQ(list.robots(1).report().pose().x(), 11);
  EXPECT_EQ(list.robots(1).report().battery(), 0.5);
  EXPECT_EQ(list.robots(1).report().fields().at("task"), "12");
  EXPECT_TRUE(list.robots(1).online());
  EXPECT_EQ(wire::DecodeTime(list.robots(1).seen_time()), clock_->Now());
}

TEST_F(RobotServiceTest, SaysThatAnOlderReportIsIgnored) {
  Report(ReportAt("a", 1));
  v1::ReportRequest older = ReportAt("a", 2);
  older.mutable_report()->mutable_stamp()->set_seconds(1);
  v1::ReportResponse response;
  ASSERT_TRUE(Report(older, &response).ok());
  EXPECT_EQ(response.outcome(), v1::REPORT_OUTCOME_OUTDATED);
  EXPECT_EQ(List().robots(0).report().pose().x(), 1);
}

TEST_F(RobotServiceTest, RefusesWrongReportsAndTooManyRobots) {
  v1::ReportResponse response;
  v1::ReportRequest request = ReportAt("", 1);
  grpc::Status status = Report(request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(), "report.robot must have 1 to 128 bytes");
  request.clear_report();
  EXPECT_EQ(Report(request, &response).error_message(), "report.stamp is missing");
  request = ReportAt("a", 1);
  request.set_map("nowhere");
  EXPECT_EQ(Report(request, &response).error_code(), grpc::StatusCode::NOT_FOUND);
  Report(ReportAt("a", 1));
  Report(ReportAt("b", 1));
  status = Report(ReportAt("c", 1), &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(status.error_message(), HasSubstr("--max_robots"));
}

TEST_F(RobotServiceTest, AWatchTellsAllRobotsAndThenWhatChanges) {
  Report(ReportAt("a", 1));
  grpc::ClientContext context;
  const auto reader = Watch(&context);
  v1::WatchRobotsResponse message;
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_TRUE(message.reset());
  EXPECT_FALSE(message.more());
  EXPECT_EQ(message.frame_id(), "map");
  EXPECT_EQ(message.revision(), 1);
  ASSERT_EQ(message.robots_size(), 1);
  EXPECT_TRUE(message.robots(0).online());

  Report(ReportAt("a", 2));
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_FALSE(message.reset());
  ASSERT_EQ(message.robots_size(), 1);
  EXPECT_EQ(message.robots(0).report().pose().x(), 2);

  machine_.Advance(absl::Seconds(10));
  List();  // notices that time has passed
  ASSERT_TRUE(reader->Read(&message));
  ASSERT_EQ(message.robots_size(), 1);
  EXPECT_FALSE(message.robots(0).online());

  machine_.Advance(absl::Hours(1));
  List();
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_EQ(message.robots_size(), 0);
  ASSERT_EQ(message.forgotten_size(), 1);
  EXPECT_EQ(message.forgotten(0), "a");
  context.TryCancel();
}

TEST_F(RobotServiceTest, DeletingTheMapEndsItsWatchesAndForgetsItsRobots) {
  Report(ReportAt("a", 1));
  grpc::ClientContext context;
  const auto reader = Watch(&context);
  v1::WatchRobotsResponse message;
  ASSERT_TRUE(reader->Read(&message));
  ASSERT_TRUE(server_.site().Delete("site", "").ok());
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
  server_.MakeMap("site", LayerOfCups("things", 1));
  EXPECT_EQ(List().robots_size(), 0);
}

TEST_F(RobotServiceTest, TheShutdownEndsWatches) {
  grpc::ClientContext context;
  const auto reader = Watch(&context);
  v1::WatchRobotsResponse message;
  ASSERT_TRUE(reader->Read(&message));
  server_.Shutdown(absl::Minutes(1));
  EXPECT_FALSE(reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(RobotServiceTest, AWatchCountsAmongTheWatches) {
  grpc::ClientContext context;
  const auto reader = Watch(&context);
  v1::WatchRobotsResponse message;
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_EQ(server_.budgets().watchers.used(), 1);
  context.TryCancel();
}

}  // namespace
}  // namespace hypermap::server
