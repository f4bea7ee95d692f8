// Frames of the wire as what perception works on.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_

#include <string>

#include "absl/status/statusor.h"
#include "hypermap/v1/frame_service.pb.h"
#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// What all frames of a stream share.
struct FrameSource {
  std::string robot;
  std::string frame_id;
  CameraModel camera;
};

// INVALID_ARGUMENT naming the field.
absl::StatusOr<FrameSource> DecodeOpening(const v1::FrameOpening& opening);

// INVALID_ARGUMENT naming the field. Instances that can't be used are left out and counted; of more
// than `max_instances` those of the highest scores are taken. Leaves what Validate(Frame) checks to
// it.
absl::StatusOr<Frame> DecodeFrame(const FrameSource& source, const v1::RobotFrame& message,
                                  int max_instances, int& bad_instances);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_
