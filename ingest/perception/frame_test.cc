#include "ingest/perception/frame.h"

#include <cmath>
#include <functional>
#include <limits>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "tests/support/not_finite.h"

namespace hypermap::ingest {
namespace {

using ::testing::HasSubstr;

using hypermap::testing::kNan;
constexpr double kInf = std::numeric_limits<double>::infinity();

// A valid frame of 4 x 3 pixels with two instances.
Frame GoodFrame() {
  Frame frame;
  frame.robot = "r1";
  frame.stamp = absl::FromUnixSeconds(1);
  frame.camera = testing::TestCamera(4);
  frame.depth = {4, 3, std::vector<float>(12, 1.5f)};
  frame.frame_from_camera = testing::LookFrom({1, 2, 1}, 0.5, 0.3);
  frame.instances = {{{{"chair", 0.5}}, testing::Mask(12, 1)}, {{{"cup", 1}}, testing::Mask(12)}};
  return frame;
}

TEST(FrameTest, GoodFramePasses) { EXPECT_TRUE(Validate(GoodFrame()).ok()); }

TEST(FrameTest, DepthWithoutAnyReturnPasses) {
  Frame frame = GoodFrame();
  frame.depth.metres.assign(12, 0.0f);
  EXPECT_TRUE(Validate(frame).ok());
}

TEST(FrameTest, WhatIsWrongIsNamed) {
  struct Case {
    const char* name;
    std::function<void(Frame*)> spoil;
  };
  const Case cases[] = {
      {"camera", [](Frame* f) { f->camera.width = 0; }},
      {"camera", [](Frame* f) { f->camera.height = -3; }},
      {"camera", [](Frame* f) { f->camera.width = 1 << 20; }},
      {"camera", [](Frame* f) { f->camera.fx = 0; }},
      {"camera", [](Frame* f) { f->camera.fy = kNan; }},
      {"camera", [](Frame* f) { f->camera.fx = kInf; }},
      {"camera", [](Frame* f) { f->camera.cx = kNan; }},
      {"camera", [](Frame* f) { f->camera.distortion[4] = kInf; }},
      {"camera.width is 16385", [](Frame* f) { f->camera.width = 16385; }},
      {"camera.fx is 1e-300", [](Frame* f) { f->camera.fx = 1e-300; }},
      {"camera.fx is 1e-38", [](Frame* f) { f->camera.fx = 1e-38; }},
      {"camera.fx is 1e+308", [](Frame* f) { f->camera.fx = 1e308; }},
      {"camera.fy is 0.5", [](Frame* f) { f->camera.fy = 0.5; }},
      {"camera.fy is -inf", [](Frame* f) { f->camera.fy = -kInf; }},
      {"camera.cx is 1e+300", [](Frame* f) { f->camera.cx = 1e300; }},
      {"camera.cy is -2e+06", [](Frame* f) { f->camera.cy = -2e6; }},
      {"camera.distortion[1] is 1e+300", [](Frame* f) { f->camera.distortion[1] = 1e300; }},
      {"camera.distortion[0] is nan", [](Frame* f) { f->camera.distortion[0] = kNan; }},
      {"depth", [](Frame* f) { f->depth.width = 3; }},
      {"depth", [](Frame* f) { f->camera.height = 4; }},
      {"depth", [](Frame* f) { f->depth.metres.pop_back(); }},
      {"depth", [](Frame* f) { f->depth.metres.clear(); }},
      {"depth", [](Frame* f) { f->depth.metres[7] = -0.001f; }},
      {"depth", [](Frame* f) { f->depth.metres[11] = std::nanf(""); }},
      {"depth", [](Frame* f) { f->depth.metres[0] = std::numeric_limits<float>::infinity(); }},
      {"pose", [](Frame* f) { f->frame_from_camera.translation().y() = kNan; }},
      {"pose", [](Frame* f) { f->frame_from_camera.translation().z() = 1e300; }},
      {"pose", [](Frame* f) { f->frame_from_camera.matrix()(0, 0) = kNan; }},
      {"pose", [](Frame* f) { f->frame_from_camera.linear() *= 1.01; }},
      {"pose", [](Frame* f) { f->frame_from_camera.linear().setZero(); }},
      // A reflection is no rotation.
      {"pose", [](Frame* f) { f->frame_from_camera.linear().col(0) *= -1; }},
      {"pose_covariance", [](Frame* f) { f->pose_covariance(1, 1) = -1e-9; }},
      {"pose_covariance", [](Frame* f) { f->pose_covariance(0, 2) = kNan; }},
      {"pose_covariance", [](Frame* f) { f->pose_covariance(2, 2) = 1e300; }},
      {"instances[0].mask", [](Frame* f) { f->instances[0].mask.pop_back(); }},
      {"instances[1].mask", [](Frame* f) { f->instances[1].mask.clear(); }},
      {"instances[1].mask", [](Frame* f) { f->instances[1].mask[3] = 2; }},
      {"instances[1].scores", [](Frame* f) { f->instances[1].scores.clear(); }},
      {"instances[0].scores[chair]", [](Frame* f) { f->instances[0].scores["chair"] = 0; }},
      {"instances[0].scores[chair]", [](Frame* f) { f->instances[0].scores["chair"] = 1.001; }},
      {"instances[1].scores[cat]", [](Frame* f) { f->instances[1].scores["cat"] = kNan; }},
  };
  for (size_t i = 0; i < std::size(cases); ++i) {
    Frame frame = GoodFrame();
    cases[i].spoil(&frame);
    const absl::Status status = Validate(frame);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << "case " << i;
    EXPECT_THAT(std::string(status.message()), HasSubstr(cases[i].name)) << "case " << i;
  }
}

}  // namespace
}  // namespace hypermap::ingest
