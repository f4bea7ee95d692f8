#include "client_libs/ros2/bridge/frame_queue.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hypermap::ros2 {
namespace {

// A frame of about a thousand bytes.
v1::RobotFrame QueuedFrame(int64_t sequence) {
  v1::RobotFrame frame;
  frame.set_sequence(sequence);
  frame.set_millimetres(std::string(1000, 'x'));
  return frame;
}

// The sequences of the next frames to send.
std::vector<int64_t> Sent(FrameQueue& queue, size_t most) {
  std::vector<int64_t> sequences;
  while (const FrameQueue::Frame frame = queue.Next(most)) sequences.push_back(frame->sequence());
  return sequences;
}

TEST(FrameQueueTest, FramesWithoutAcknowledgementAreSentAgain) {
  FrameQueue queue(100'000);
  for (int i = 1; i <= 5; ++i) EXPECT_EQ(queue.Push(QueuedFrame(i)), 0);
  EXPECT_EQ(Sent(queue, 3), (std::vector<int64_t>{1, 2, 3}));
  EXPECT_TRUE(queue.Remove(2));
  EXPECT_FALSE(queue.Remove(2));
  EXPECT_EQ(Sent(queue, 3), (std::vector<int64_t>{4}));
  queue.SendAgain();
  EXPECT_EQ(Sent(queue, 9), (std::vector<int64_t>{1, 3, 4, 5}));
}

TEST(FrameQueueTest, TheOldestThatWaitAreDropped) {
  FrameQueue queue(3'500);
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(queue.Push(QueuedFrame(i)), 0);
  EXPECT_EQ(Sent(queue, 1), (std::vector<int64_t>{1}));
  EXPECT_EQ(queue.Push(QueuedFrame(4)), 1) << "2; 1 was sent";
  EXPECT_EQ(Sent(queue, 9), (std::vector<int64_t>{3, 4}));
  EXPECT_EQ(queue.Push(QueuedFrame(5)), 1) << "itself, since all others were sent";
  EXPECT_EQ(queue.size(), 3U);
  EXPECT_TRUE(queue.Remove(1));
  EXPECT_EQ(queue.Push(QueuedFrame(6)), 0);
  EXPECT_EQ(Sent(queue, 9), (std::vector<int64_t>{6}));
}

TEST(FrameQueueTest, FramesThatWereSentCanBeGivenUp) {
  FrameQueue queue(100'000);
  for (int i = 1; i <= 3; ++i) queue.Push(QueuedFrame(i));
  EXPECT_EQ(Sent(queue, 2).size(), 2U);
  EXPECT_EQ(queue.RemoveSent(), 2);
  EXPECT_EQ(Sent(queue, 9), (std::vector<int64_t>{3}));
}

}  // namespace
}  // namespace hypermap::ros2
