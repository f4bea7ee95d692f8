#include "ingest/frame_service/frame_decode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"

namespace hypermap::ingest {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

v1::FrameOpening Opening() {
  v1::FrameOpening opening;
  opening.set_robot("cart");
  opening.set_frame_id("site");
  v1::CameraModel* camera = opening.mutable_camera();
  camera->set_width(2);
  camera->set_height(2);
  camera->set_fx(100);
  camera->set_fy(101);
  camera->set_cx(0.5);
  camera->set_cy(0.25);
  camera->add_distortion(0.1);
  return opening;
}

// A frame of 2 x 2 pixels from a camera 1 m up that looks along x. The depths of the top row are
// 1 m and 0.513 m, and the right pixel of the bottom row is an instance.
v1::RobotFrame Message() {
  v1::RobotFrame message;
  message.set_sequence(7);
  message.mutable_stamp()->set_seconds(1500000000);
  v1::CameraPose* pose = message.mutable_pose();
  pose->set_z(1);
  pose->set_qx(-0.5);
  pose->set_qy(0.5);
  pose->set_qz(-0.5);
  pose->set_qw(0.5);
  message.set_millimetres(std::string("\xe8\x03\x01\x02\x00\x00\xff\xff", 8));
  v1::FrameInstance* instance = message.add_instances();
  v1::ClassScore* score = instance->add_scores();
  score->set_label("cup");
  score->set_score(0.5);
  for (const int count : {3, 1}) instance->mutable_runs()->add_counts(count);
  return message;
}

class FrameDecodeTest : public testing::Test {
 protected:
  absl::StatusOr<Frame> Decode(const v1::RobotFrame& message, int max_instances = 10) {
    return DecodeFrame(*DecodeOpening(Opening()), message, max_instances, bad_instances_);
  }
  std::string Error(const v1::RobotFrame& message) {
    return std::string(Decode(message).status().message());
  }

  int bad_instances_ = 0;
};

TEST_F(FrameDecodeTest, AFrameIsWhatTheMessageSays) {
  const auto frame = Decode(Message());
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_TRUE(Validate(*frame).ok()) << Validate(*frame);
  EXPECT_EQ(frame->robot, "cart");
  EXPECT_EQ(frame->frame_id, "site");
  EXPECT_EQ(frame->sequence, 7);
  EXPECT_EQ(frame->stamp, absl::FromUnixSeconds(1500000000));
  EXPECT_EQ(frame->camera.fy, 101.0);
  EXPECT_EQ(frame->camera.distortion[0], 0.1);
  EXPECT_THAT(frame->depth.metres,
              ElementsAre(1.0f, testing::FloatEq(0.513f), 0.0f, testing::FloatEq(65.535f)));
  EXPECT_TRUE((frame->frame_from_camera * Eigen::Vector3d(0, 0, 2))
                  .isApprox(Eigen::Vector3d(2, 0, 1), 1e-12));
  EXPECT_TRUE(frame->pose_covariance.isZero());
  ASSERT_EQ(frame->instances.size(), 1u);
  EXPECT_THAT(frame->instances[0].scores, ElementsAre(Pair("cup", 0.5)));
  EXPECT_THAT(frame->instances[0].mask, ElementsAre(0, 0, 0, 1));
  EXPECT_EQ(bad_instances_, 0);
}

TEST_F(FrameDecodeTest, CovarianceIsRowMajor) {
  v1::RobotFrame message = Message();
  for (int i = 0; i < 9; ++i) message.mutable_pose()->add_covariance(i);
  EXPECT_EQ(Decode(message)->pose_covariance(0, 1), 1.0);
  message.mutable_pose()->mutable_covariance()->RemoveLast();
  EXPECT_THAT(Error(message), HasSubstr("covariance"));
}

TEST_F(FrameDecodeTest, AnErrorNamesTheField) {
  v1::RobotFrame message = Message();
  message.clear_stamp();
  EXPECT_THAT(Error(message), HasSubstr("frame.stamp"));
  message = Message();
  message.mutable_pose()->set_qw(2);
  EXPECT_THAT(Error(message), HasSubstr("frame.pose"));
  message = Message();
  message.mutable_pose()->set_x(std::numeric_limits<double>::infinity());
  EXPECT_THAT(Error(message), HasSubstr("frame.pose"));
  message = Message();
  message.set_millimetres("abc");
  EXPECT_THAT(Error(message), HasSubstr("frame.millimetres has 3 bytes"));
  message.clear_depth();
  EXPECT_THAT(Error(message), HasSubstr("frame.depth"));
  message.mutable_png()->set_png("no image");
  EXPECT_THAT(Error(message), HasSubstr("PNG"));
}

TEST_F(FrameDecodeTest, InstancesThatAreWrongAreLeftOutAndCounted) {
  v1::RobotFrame message = Message();
  for (int i = 0; i < 5; ++i) *message.add_instances() = message.instances(0);
  message.mutable_instances(1)->clear_mask();
  message.mutable_instances(2)->mutable_scores(0)->set_score(0.0);
  message.mutable_instances(3)->mutable_runs()->set_counts(0, -3);
  message.mutable_instances(4)->set_packed_runs("zz");
  message.mutable_instances(5)->clear_scores();
  const auto frame = Decode(message);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->instances.size(), 1u);
  EXPECT_EQ(bad_instances_, 5);
}

TEST_F(FrameDecodeTest, OfTooManyInstancesTheBestAreTaken) {
  v1::RobotFrame message = Message();
  for (int i = 1; i <= 4; ++i) {
    *message.add_instances() = message.instances(0);
    message.mutable_instances(i)->mutable_scores(0)->set_score(0.2 * i);
  }
  const auto frame = Decode(message, 2);
  ASSERT_EQ(frame->instances.size(), 2u);
  EXPECT_NEAR(frame->instances[0].scores.at("cup"), 0.8, 1e-12);
  EXPECT_NEAR(frame->instances[1].scores.at("cup"), 0.6, 1e-12);
  EXPECT_EQ(bad_instances_, 3);
}

TEST_F(FrameDecodeTest, OfEqualScoresTheFirstInstancesAreTaken) {
  v1::RobotFrame message = Message();
  for (int i = 1; i < 300; ++i) {
    *message.add_instances() = message.instances(0);
    message.mutable_instances(i)->mutable_scores(0)->set_label(std::to_string(i));
  }
  const auto frame = Decode(message, 3);
  ASSERT_EQ(frame->instances.size(), 3u);
  EXPECT_EQ(frame->instances[1].scores.count("1"), 1u);
  EXPECT_EQ(frame->instances[2].scores.count("2"), 1u);
  EXPECT_EQ(bad_instances_, 297);
}

TEST_F(FrameDecodeTest, UnitsOfDepthAreThoseOfCameras) {
  v1::RobotFrame message = Message();
  for (const double units : {-1.0, 1e-300, 0.5, 1e300, std::nan("")}) {
    message.mutable_png()->set_units_per_metre(units);
    EXPECT_THAT(Error(message), HasSubstr("frame.png.units_per_metre is")) << units;
  }
}

TEST_F(FrameDecodeTest, GivesUpWhereverItIsCancelled) {
  v1::RobotFrame message = Message();
  for (int i = 0; i < 9; ++i) *message.add_instances() = message.instances(0);
  EXPECT_GT(TimesCancelled([&] { return Decode(message).status(); }), 4);
}

TEST(MemoryOfInstancesTest, IsThatOfTheMasksAndClasses) {
  v1::FrameOpening opening = Opening();
  opening.mutable_camera()->set_width(1000);
  opening.mutable_camera()->set_height(500);
  const FrameSource source = *DecodeOpening(opening);
  v1::RobotFrame message;
  EXPECT_EQ(MemoryOfInstances(source, message, 254), 0);
  for (int i = 0; i < 1000; ++i) message.add_instances();
  // Instances without a mask take no pixels.
  EXPECT_LE(MemoryOfInstances(source, message, 254), 1000 * 100);
  for (v1::FrameInstance& instance : *message.mutable_instances()) instance.set_packed_runs("0");
  EXPECT_GE(MemoryOfInstances(source, message, 254), 254 * 500'000);
  EXPECT_LE(MemoryOfInstances(source, message, 254), 255 * 500'000);
  message.mutable_instances(0)->add_scores()->set_label(std::string(1'000'000, 'x'));
  EXPECT_GE(MemoryOfInstances(source, message, 0), 5'000'000);
}

TEST(DecodeOpeningTest, AnErrorNamesTheFieldAndItsValue) {
  const std::vector<std::pair<std::string, std::function<void(v1::CameraModel*)>>> cases = {
      {"opening.camera.width is 0", [](auto* c) { c->set_width(0); }},
      {"opening.camera.width is 4097", [](auto* c) { c->set_width(4097); }},
      {"opening.camera.height is -5", [](auto* c) { c->set_height(-5); }},
      {"opening.camera.fx is 1e-300", [](auto* c) { c->set_fx(1e-300); }},
      {"opening.camera.fx is 1e+308", [](auto* c) { c->set_fx(1e308); }},
      {"opening.camera.fy is 1e-12", [](auto* c) { c->set_fy(1e-12); }},
      {"opening.camera.fy is nan", [](auto* c) { c->set_fy(std::nan("")); }},
      {"opening.camera.cx is 1e+300", [](auto* c) { c->set_cx(1e300); }},
      {"opening.camera.cy is -inf",
       [](auto* c) { c->set_cy(-std::numeric_limits<double>::infinity()); }},
      {"opening.camera.distortion[0] is 1e+300", [](auto* c) { c->set_distortion(0, 1e300); }},
  };
  for (const auto& [message, spoil] : cases) {
    v1::FrameOpening opening = Opening();
    spoil(opening.mutable_camera());
    const absl::Status status = DecodeOpening(opening).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << message;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
  }
  v1::FrameOpening opening = Opening();
  opening.set_robot(std::string(257, 'r'));
  EXPECT_THAT(std::string(DecodeOpening(opening).status().message()),
              HasSubstr("opening.robot has 257 bytes"));
  opening = Opening();
  opening.set_frame_id(std::string(100'000, 'f'));
  EXPECT_THAT(std::string(DecodeOpening(opening).status().message()),
              HasSubstr("opening.frame_id has 100000 bytes"));
}

TEST(DecodeOpeningTest, AnErrorNamesTheField) {
  const auto error = [](const v1::FrameOpening& opening) {
    return std::string(DecodeOpening(opening).status().message());
  };
  v1::FrameOpening opening = Opening();
  EXPECT_EQ(error(opening), "");
  opening.clear_robot();
  EXPECT_THAT(error(opening), HasSubstr("opening.robot"));
  opening = Opening();
  opening.mutable_camera()->set_width(1 << 20);
  EXPECT_THAT(error(opening), HasSubstr("opening.camera"));
  opening = Opening();
  opening.mutable_camera()->set_fx(0);
  EXPECT_THAT(error(opening), HasSubstr("opening.camera"));
  opening = Opening();
  for (int i = 0; i < 5; ++i) opening.mutable_camera()->add_distortion(0);
  EXPECT_THAT(error(opening), HasSubstr("distortion"));
}

}  // namespace
}  // namespace hypermap::ingest
