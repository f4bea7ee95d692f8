// The frames that an ingest worker has not acknowledged.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_FRAME_QUEUE_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_FRAME_QUEUE_H_

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "hypermap/v1/frame_service.pb.h"

namespace hypermap::ros2 {

// A queue of bounded size, whose first frames were sent and the others wait. Used by one thread at
// a time.
class FrameQueue {
 public:
  using Frame = std::shared_ptr<const v1::RobotFrame>;

  explicit FrameQueue(int64_t max_bytes) : max_bytes_(max_bytes) {}

  // Returns the number of frames that are dropped for it: the oldest that wait, itself at last.
  int Push(v1::RobotFrame frame);

  // Returns the next frame to send, which counts as sent then; null if `most` were sent already, or
  // none waits.
  Frame Next(size_t most);
  // All frames wait again, because the stream has broken.
  void SendAgain() { num_sent_ = 0; }
  // Removes a frame that was acknowledged. Returns whether it was there.
  bool Remove(int64_t sequence);
  // Removes the frames that were sent, and returns their number.
  int RemoveSent();

  size_t size() const { return frames_.size(); }
  size_t num_sent() const { return num_sent_; }

 private:
  struct Kept {
    Frame frame;
    int64_t bytes = 0;
  };
  void Erase(size_t index);

  const int64_t max_bytes_;
  std::deque<Kept> frames_;
  size_t num_sent_ = 0;
  int64_t bytes_ = 0;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_FRAME_QUEUE_H_
