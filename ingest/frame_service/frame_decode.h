// Conversion of frames from protobuf to the input of perception. It stands here and not in wire/,
// which must not depend on ingest/perception.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "hypermap/v1/frame_service.pb.h"
#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// The largest width and height of a camera whose frames are streamed.
inline constexpr int kMaxStreamedSide = 4096;

// The fields that all frames of a stream share.
struct FrameSource {
  std::string robot;
  std::string frame_id;
  CameraModel camera;
};

// Decodes the first message of a stream. Errors: INVALID_ARGUMENT, naming the field.
absl::StatusOr<FrameSource> DecodeOpening(const v1::FrameOpening& opening);

// Estimates the memory that a decoded frame takes for its instances, and that perception takes for
// their classes. To be asked before the frame is decoded: each mask has all pixels of the image,
// whatever it takes in the message.
int64_t MemoryOfInstances(const FrameSource& source, const v1::RobotFrame& message,
                          int max_instances);

// Decodes a frame. Of more than `max_instances` instances those with the highest scores are taken.
// Instances that are left out or can't be decoded are added to `bad_instances`. Errors:
// INVALID_ARGUMENT, naming the field; the checks of Validate(Frame) are left to it. CANCELLED if
// the work of this thread is cancelled.
absl::StatusOr<Frame> DecodeFrame(const FrameSource& source, const v1::RobotFrame& message,
                                  int max_instances, int& bad_instances);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_DECODE_H_
