// Detections and label images as the instances of a frame (docs/ros2.md, Detections).
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_INSTANCES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_INSTANCES_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "client_libs/ros2/conversion/labels.h"
#include "client_libs/ros2/messages/messages.h"
#include "google/protobuf/repeated_ptr_field.h"
#include "hypermap/v1/frame_service.pb.h"

namespace hypermap::ros2 {

using FrameInstances = google::protobuf::RepeatedPtrField<v1::FrameInstance>;

// All pixels whose centre is in the box of a detection are its instance. In a box, the centre of
// the top left pixel is (0.5, 0.5): boxes of detectors count from the image's edge. A class that
// `labels` does not have keeps its id as the label. A detection without a class that has a score in
// (0, 1] and a label in UTF-8, or outside of the image, is left out and added to `num_skipped`; so
// are all but the 254 with the highest scores, of which the worker takes no more.
FrameInstances BoxInstances(const vision_msgs::Detection2DArray& message, const Labels& labels,
                            const v1::CameraModel& camera, int64_t* num_skipped);

struct LabelImageOptions {
  // Of the classes; pixels of others are background.
  Labels labels;
  // 0: the number of a pixel is its class, and each 8-connected region of a class is an instance,
  // at most 254 of a class, the largest first. Otherwise the number is class * divisor + instance,
  // as in panoptic segmentation; at most 254 of a class are taken, the lowest numbers.
  int32_t divisor = 0;
  // Of all instances.
  double score = 0.9;
};

// The instances of a label image, by ascending number. INVALID_ARGUMENT as LabelNumbers.
absl::StatusOr<FrameInstances> LabelImageInstances(const sensor_msgs::Image& image,
                                                   const LabelImageOptions& options,
                                                   const v1::CameraModel& camera);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_INSTANCES_H_
