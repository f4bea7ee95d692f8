#include "wire/observation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "base/limits/limits.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "tests/support/random_map.h"

namespace hypermap::wire {
namespace {

using hypermap::testing::RandomPolygon;
using hypermap::testing::RandomTransform;
using hypermap::testing::Rng;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;
using ::testing::HasSubstr;

Detection RandomDetection(Rng& rng) {
  Detection detection;
  const int classes = UniformInt(rng, 1, 3);
  for (int i = 0; i < classes; ++i) {
    detection.scores["class " + std::to_string(i)] = Uniform(rng, 0.01, 1.0);
  }
  detection.hull = RandomPolygon(rng, {Uniform(rng, -5, 5), 2}, 1.0);
  detection.cells.frame_from_cells = RandomTransform(rng, 10.0);
  detection.cells.resolution_m = 0.02;
  for (int32_t row = -3, col = 0; row < 4; row += UniformInt(rng, 0, 2)) {
    col = UniformInt(rng, -100, 100) + (detection.cells.spans.size() > 40 ? 1000 : 0);
    detection.cells.spans.push_back({row, col, col + UniformInt(rng, 1, 30)});
    if (detection.cells.spans.size() > 50) break;
  }
  detection.height = {Uniform(rng, 0, 1), Uniform(rng, 1, 2)};
  detection.num_points = UniformInt(rng, 0, 5000);
  detection.range_m = Uniform(rng, 0.5, 8);
  detection.truncation = Uniform(rng, 0, 1);
  detection.weight = Uniform(rng, 0.01, 1);
  return detection;
}

DepthView RandomView(Rng& rng) {
  DepthView view{8, 6, 52.5, 53.5, 3.9, 2.9, {}, {}};
  for (int i = 0; i < 48; ++i) {
    view.depth_mm.push_back(static_cast<uint16_t>(UniformInt(rng, 0, 65535)));
    view.owner.push_back(static_cast<uint8_t>(UniformInt(rng, 0, 1) * 255));
  }
  return view;
}

Observation RandomObservation(Rng& rng) {
  Observation o;
  o.robot = "robot " + std::to_string(UniformInt(rng, 0, 9));
  o.sequence = UniformInt(rng, 0, 1'000'000);
  o.stamp = absl::FromUnixNanos(1'700'000'000'123'456'789 + UniformInt(rng, 0, 1'000'000));
  if (UniformInt(rng, 0, 1) == 1) o.frame_id = "dock";
  const Eigen::Vector3d axis(Uniform(rng, -1, 1), Uniform(rng, -1, 1), Uniform(rng, 0.1, 1));
  o.pose.frame_from_camera.rotate(Eigen::AngleAxisd(Uniform(rng, -3, 3), axis.normalized()));
  o.pose.frame_from_camera.pretranslate(Eigen::Vector3d(Uniform(rng, -9, 9), 2.0, 0.7));
  if (UniformInt(rng, 0, 1) == 1) {
    o.pose.covariance << 0.01, 0.002, 0.0, 0.002, 0.02, 1e-4, 0.0, 1e-4, 0.001;
  }
  if (UniformInt(rng, 0, 1) == 1) o.frame_from_view = RandomTransform(rng, 10.0);
  if (UniformInt(rng, 0, 1) == 1) o.view_hull = RandomPolygon(rng, {0, 0}, 4.0);
  if (UniformInt(rng, 0, 1) == 1) o.free_space = RandomPolygon(rng, {1, 0}, 4.0);
  if (UniformInt(rng, 0, 1) == 1) o.depth = RandomView(rng);
  const int detections = UniformInt(rng, 0, 4);
  for (int i = 0; i < detections; ++i) o.detections.push_back(RandomDetection(rng));
  return o;
}

void ExpectEqual(const Observation& a, const Observation& b) {
  EXPECT_EQ(KeyOf(a), KeyOf(b));
  EXPECT_EQ(a.frame_id, b.frame_id);
  EXPECT_EQ(a.frame_from_view, b.frame_from_view);
  EXPECT_EQ(a.pose.frame_from_camera.matrix(), b.pose.frame_from_camera.matrix());
  EXPECT_EQ(a.pose.covariance, b.pose.covariance);
  EXPECT_EQ(a.view_hull, b.view_hull);
  EXPECT_EQ(a.free_space, b.free_space);
  EXPECT_EQ(a.depth, b.depth);
  EXPECT_EQ(a.detections, b.detections);
}

TEST(ObservationOnTheWire, RandomOnesComeBackEqualThroughBytes) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int i = 0; i < 200; ++i) {
    const Observation observation = RandomObservation(rng);
    v1::Observation sent;
    EncodeObservation(observation, &sent);
    v1::Observation received;
    ASSERT_TRUE(received.ParseFromString(sent.SerializeAsString()));
    const auto decoded = DecodeObservation("observation", received, Limits());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    ExpectEqual(*decoded, observation);
  }
}

TEST(ObservationAsBytes, IsExactAndTheSameForTheSameObservation) {
  const uint64_t seed = hypermap::testing::TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int i = 0; i < 100; ++i) {
    const Observation observation = RandomObservation(rng);
    const std::string bytes = ObservationToBytes(observation);
    const auto decoded = ObservationFromBytes(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    ExpectEqual(*decoded, observation);
    EXPECT_EQ(ObservationToBytes(*decoded), bytes);
  }
}

TEST(ObservationAsBytes, DamageIsTold) {
  EXPECT_EQ(ObservationFromBytes("\xff\xff").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(ObservationFromBytes("").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(ObjectFromBytes("\xff\xff").status().code(), absl::StatusCode::kDataLoss);
}

TEST(ObservationOnTheWire, BadOnesNameTheField) {
  Rng rng(1);
  v1::Observation good;
  Observation observation = RandomObservation(rng);
  observation.depth = RandomView(rng);
  observation.detections = {RandomDetection(rng), RandomDetection(rng)};
  observation.frame_from_view.reset();
  EncodeObservation(observation, &good);
  const auto problem = [&](auto change) {
    v1::Observation message = good;
    change(message);
    const auto decoded = DecodeObservation("o", message, Limits());
    EXPECT_EQ(decoded.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(decoded.status().message());
  };
  EXPECT_THAT(problem([](auto& m) { m.clear_stamp(); }), HasSubstr("o.stamp"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_stamp()->set_seconds(int64_t{1} << 40); }),
              HasSubstr("o.stamp"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_pose()->mutable_rotation()->RemoveLast(); }),
              HasSubstr("o.pose.rotation"));
  EXPECT_THAT(problem([](auto& m) { m.clear_pose(); }), HasSubstr("o.pose"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_pose()->add_covariance(1); }), HasSubstr("o.pose"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_view(); }), HasSubstr("o.view must not be set"));
  const auto problem_of_view = [&](auto change) {
    return problem([&](auto& m) {
      m.mutable_view()->mutable_frame_from_view();
      *m.mutable_view()->mutable_camera() = m.pose();
      m.clear_pose();
      change(*m.mutable_view());
    });
  };
  EXPECT_THAT(problem_of_view([](auto& v) { v.clear_frame_from_view(); }),
              HasSubstr("o.view.frame_from_view is missing"));
  EXPECT_THAT(problem_of_view([](auto& v) { v.mutable_frame_from_view()->set_x(std::nan("")); }),
              HasSubstr("o.view.frame_from_view is not finite"));
  EXPECT_THAT(problem_of_view([](auto& v) { v.clear_camera(); }),
              HasSubstr("o.view.camera.rotation"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_depth()->mutable_depth_mm()->push_back('x'); }),
              HasSubstr("o.depth.depth_mm"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_detections(1)->clear_hull(); }),
              HasSubstr("o.detections[1].hull"));
  EXPECT_THAT(problem([](auto& m) { m.mutable_detections(1)->mutable_cells()->add_spans(1); }),
              HasSubstr("o.detections[1].cells.spans"));
  EXPECT_THAT(problem([](auto& m) {
                for (int i = 0; i < 6; ++i) {
                  m.mutable_detections(0)->mutable_cells()->add_spans(2'000'000'000);
                }
              }),
              HasSubstr("o.detections[0].cells.spans"));
  EXPECT_THAT(problem([](auto& m) {
                m.mutable_detections(1)->mutable_cells()->mutable_origin()->set_y(1e308);
              }),
              HasSubstr("o.detections[1].cells.origin: x or y is more than 1e+09 m"));
  EXPECT_THAT(
      problem([](auto& m) { *m.mutable_detections(0)->add_scores() = m.detections(0).scores(0); }),
      HasSubstr("o.detections[0].scores"));
}

TEST(PoseCorrectionWireTest, RoundTrips) {
  PoseCorrection correction{"rob", {}};
  for (int i = 0; i < 3; ++i) {
    CorrectedPose pose{absl::FromUnixNanos(1'700'000'000'123'456'789 + i),
                       PlanarTransform(0.1 * i, -1.0 / 3, 3.0), Eigen::Matrix3d::Zero()};
    if (i > 0) pose.covariance.diagonal() << 1e-4, 2e-4, 0.1 * i;
    correction.poses.push_back(pose);
  }
  const std::string bytes = CorrectionToBytes(correction);
  const auto decoded = CorrectionFromBytes(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->robot, "rob");
  ASSERT_EQ(decoded->poses.size(), 3u);
  EXPECT_EQ(decoded->poses[1].stamp, correction.poses[1].stamp);
  EXPECT_EQ(decoded->poses[1].frame_from_view, correction.poses[1].frame_from_view);
  EXPECT_EQ(decoded->poses[2].covariance, correction.poses[2].covariance);
  EXPECT_EQ(CorrectionToBytes(*decoded), bytes);
  EXPECT_FALSE(decoded->is_smoothed);
  correction.is_smoothed = true;
  EXPECT_TRUE(CorrectionFromBytes(CorrectionToBytes(correction))->is_smoothed);
  EXPECT_EQ(CorrectionFromBytes("no message").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(CorrectionFromBytes("").status().code(), absl::StatusCode::kDataLoss);
}

TEST(PoseCorrectionWireTest, ErrorsNameTheField) {
  const auto problem = [](const std::function<void(v1::CorrectedPose&)>& change) {
    v1::CorrectPosesRequest request;
    for (int i = 0; i < 2; ++i) {
      request.add_poses()->mutable_stamp();
      request.mutable_poses(i)->mutable_pose();
    }
    change(*request.mutable_poses(1));
    return std::string(DecodeCorrectedPoses(request.poses()).status().message());
  };
  EXPECT_EQ(problem([](auto&) {}), "");
  EXPECT_THAT(problem([](auto& p) { p.clear_stamp(); }), HasSubstr("poses[1].stamp is missing"));
  EXPECT_THAT(problem([](auto& p) { p.mutable_stamp()->set_nanos(-1); }),
              HasSubstr("poses[1].stamp"));
  EXPECT_THAT(problem([](auto& p) { p.clear_pose(); }), HasSubstr("poses[1].pose is missing"));
  EXPECT_THAT(problem([](auto& p) { p.mutable_pose()->set_yaw(std::nan("")); }),
              HasSubstr("poses[1].pose"));
  EXPECT_THAT(problem([](auto& p) { p.add_covariance(1.0); }), HasSubstr("poses[1].covariance"));
}

}  // namespace
}  // namespace hypermap::wire
