#include "client_libs/ros2/bridge/frame_queue.h"

#include <algorithm>
#include <utility>

namespace hypermap::ros2 {

int FrameQueue::Push(v1::RobotFrame frame) {
  const auto bytes = static_cast<int64_t>(frame.ByteSizeLong());
  frames_.push_back({std::make_shared<const v1::RobotFrame>(std::move(frame)), bytes});
  bytes_ += bytes;
  int num_dropped = 0;
  for (; bytes_ > max_bytes_ && num_sent_ < frames_.size(); ++num_dropped) Erase(num_sent_);
  return num_dropped;
}

FrameQueue::Frame FrameQueue::Next(size_t most) {
  if (num_sent_ >= most || num_sent_ == frames_.size()) return nullptr;
  return frames_[num_sent_++].frame;
}

bool FrameQueue::Remove(int64_t sequence) {
  const auto it = std::find_if(frames_.begin(), frames_.end(), [&](const Kept& kept) {
    return kept.frame->sequence() == sequence;
  });
  if (it == frames_.end()) return false;
  const size_t index = it - frames_.begin();
  Erase(index);
  if (index < num_sent_) --num_sent_;
  return true;
}

int FrameQueue::RemoveSent() {
  const int num_removed = static_cast<int>(num_sent_);
  for (; num_sent_ > 0; --num_sent_) Erase(0);
  return num_removed;
}

void FrameQueue::Erase(size_t index) {
  bytes_ -= frames_[index].bytes;
  frames_.erase(frames_.begin() + static_cast<std::ptrdiff_t>(index));
}

}  // namespace hypermap::ros2
