// Conversion of frames from protobuf to the input of perception.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_

#include <string>

#include "absl/status/statusor.h"
#include "hypermap/v1/frame_service.pb.h"
#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// The fields that all frames of a stream share.
struct FrameSource {
  std::string robot;
  std::string frame_id;
  CameraModel camera;
};

// Decodes the first message of a stream. Errors: INVALID_ARGUMENT, naming the field.
absl::StatusOr<FrameSource> DecodeOpening(const v1::FrameOpening& opening);

// Decodes a frame. Of more than `max_instances` instances those with the highest scores are taken.
// Instances that are left out or can't be decoded are added to `bad_instances`. Errors:
// INVALID_ARGUMENT, naming the field; the checks of Validate(Frame) are left to it.
absl::StatusOr<Frame> DecodeFrame(const FrameSource& source, const v1::RobotFrame& message,
                                  int max_instances, int& bad_instances);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_
