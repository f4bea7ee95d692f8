// Messages of a camera and of tf, whatever their bytes are, become frames whose masks have all
// pixels of the camera's image, and transforms that are finite; or they are refused. The first byte
// tells the message.
#include <cstddef>
#include <cstdint>
#include <string>

#include "client_libs/ros2/bridge/transform_buffer.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/conversion/images.h"
#include "client_libs/ros2/conversion/instances.h"
#include "client_libs/ros2/conversion/labels.h"
#include "client_libs/ros2/messages/messages.h"
#include "tests/fuzz/require.h"

namespace {

using namespace hypermap;        // NOLINT(google-build-using-namespace)
using namespace hypermap::ros2;  // NOLINT(google-build-using-namespace)

constexpr int kWidth = 5;
constexpr int kHeight = 3;
constexpr int kMaxInstances = 254;

v1::CameraModel Camera() {
  v1::CameraModel camera;
  camera.set_width(kWidth);
  camera.set_height(kHeight);
  return camera;
}

void CheckInstances(const FrameInstances& instances) {
  for (const v1::FrameInstance& instance : instances) {
    REQUIRE(instance.scores_size() > 0);
    int64_t num_pixels = 0;
    for (const int32_t count : instance.runs().counts()) {
      REQUIRE(count >= 0);
      num_pixels += count;
    }
    REQUIRE(num_pixels == kWidth * kHeight);
    v1::FrameInstance parsed;  // Fails for labels that are not UTF-8.
    REQUIRE(parsed.ParseFromString(instance.SerializeAsString()));
  }
}

void ReadDetections(absl::string_view bytes) {
  const auto message = DecodeCdr<vision_msgs::Detection2DArray>(bytes);
  if (!message.ok()) return;
  int64_t num_skipped = 0;
  const FrameInstances instances = BoxInstances(*message, {{"1", "cup"}}, Camera(), &num_skipped);
  REQUIRE(instances.size() + num_skipped == static_cast<int64_t>(message->detections.size()));
  CheckInstances(instances);
}

void ReadImage(absl::string_view bytes) {
  const auto image = DecodeCdr<sensor_msgs::Image>(bytes);
  if (!image.ok()) return;
  v1::RobotFrame frame;
  if (EncodeDepth(*image, Camera(), &frame).ok()) {
    REQUIRE(frame.has_png() || frame.millimetres().size() == 2 * kWidth * kHeight);
  }
  for (const int32_t divisor : {0, 7}) {
    const auto instances = LabelImageInstances(
        *image, {.labels = {{"0", "cup"}, {"1", "cat"}}, .divisor = divisor}, Camera());
    if (!instances.ok()) continue;
    REQUIRE(instances->size() <= 2 * kMaxInstances);
    CheckInstances(*instances);
  }
}

void ReadCameraInfo(absl::string_view bytes) {
  const auto message = DecodeCdr<sensor_msgs::CameraInfo>(bytes);
  if (!message.ok()) return;
  for (const bool is_rectified : {false, true}) {
    const auto camera = ToCameraModel(*message, is_rectified);
    if (!camera.ok()) continue;
    REQUIRE(camera->width() >= 1 && camera->height() >= 1 && camera->fx() > 0);
    REQUIRE(camera->distortion_size() <= 5);
  }
}

void ReadTransforms(absl::string_view bytes, bool is_static) {
  const auto message = DecodeCdr<tf2_msgs::TFMessage>(bytes);
  if (!message.ok()) return;
  TransformBuffer buffer(absl::Milliseconds(500));
  for (const auto& transform : message->transforms) buffer.Add(transform, is_static).IgnoreError();
  for (const auto& transform : message->transforms) {
    const std::string& frame = transform.child_frame_id;
    const auto newest = buffer.Newest("map", frame);
    if (!newest.ok()) continue;
    REQUIRE(buffer.At("map", frame, newest->stamp, TransformBuffer::AfterNewest::kNothing).ok());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const absl::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 6) {
    case 0:
      ReadDetections(bytes);
      break;
    case 1:
      ReadImage(bytes);
      break;
    case 2:
      ReadCameraInfo(bytes);
      break;
    case 3:
      ReadTransforms(bytes, /*is_static=*/false);
      break;
    case 4:
      ReadTransforms(bytes, /*is_static=*/true);
      break;
    default:
      ParseLabels(bytes).IgnoreError();
  }
  return 0;
}
