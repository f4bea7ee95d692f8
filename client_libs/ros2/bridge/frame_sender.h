// Sends frames of a camera to an ingest worker, which may be restarted meanwhile.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_FRAME_SENDER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_FRAME_SENDER_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "hypermap/v1/frame_service.pb.h"

namespace hypermap::ros2 {

struct FrameSenderOptions {
  std::string worker;  // HOST:PORT
  v1::FrameOpening opening;
  // Bytes of the frames that are kept, because the worker has not acknowledged them. When there are
  // more, the oldest that wait to be sent are dropped.
  int64_t max_bytes = int64_t{256} << 20;
  // A stream on which the worker is silent for so long, although it owes an answer, is broken.
  absl::Duration patience = absl::Seconds(60);
};

// Numbers of frames since the start.
struct FrameCounts {
  int64_t accepted = 0;
  int64_t duplicates = 0;  // the layer had them already
  int64_t refused = 0;     // late, invalid or conflicting
  int64_t dropped = 0;     // never acknowledged

  friend bool operator==(const FrameCounts&, const FrameCounts&) = default;
};

// Keeps each frame until it is acknowledged. If the stream breaks, another one is opened as soon as
// the worker is there, and frames without acknowledgement are sent again, which count once. Two
// threads: one sends, one reads acknowledgements. Thread safe.
class FrameSender {
 public:
  // The worker need not be there. RESOURCE_EXHAUSTED if no thread can be started.
  static absl::StatusOr<std::unique_ptr<FrameSender>> Start(FrameSenderOptions options);
  // Gives up the frames that are not acknowledged.
  ~FrameSender();

  // Takes a frame, and does not wait.
  void Send(v1::RobotFrame frame);

  FrameCounts counts() const;
  // The number of frames that are kept.
  int64_t num_kept() const;

 private:
  class Loop;
  explicit FrameSender(std::unique_ptr<Loop> loop);

  const std::unique_ptr<Loop> loop_;
  std::unique_ptr<Executor::Running> running_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_FRAME_SENDER_H_
