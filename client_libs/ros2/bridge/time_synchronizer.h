// Pairs the messages of two topics by their stamps.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TIME_SYNCHRONIZER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TIME_SYNCHRONIZER_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/time/time.h"

namespace hypermap::ros2 {

// Pairs messages as ApproximateTimeSynchronizer of ROS's message_filters does, and hypermap-bag. A
// message that arrives is paired at once with the message of the other topic that is nearest in
// time, if it is within the slop and still waits. Otherwise it waits in the queue of its topic; the
// oldest leaves a full queue. Unlike there, a difference of exactly the slop is within it, and
// after the clock was set back by more than ten seconds the queues begin anew.
//
// Used by one thread at a time.
template <typename First, typename Second>
class TimeSynchronizer {
 public:
  TimeSynchronizer(size_t queue, absl::Duration slop) : size_(queue), slop_(slop) {}

  // Return the pair of the message, if it has found its partner.
  std::optional<std::pair<First, Second>> AddFirst(absl::Time stamp, First message) {
    std::optional<Second> partner = Add(stamp, &message, &first_, &second_);
    if (!partner) return std::nullopt;
    return std::pair(std::move(message), *std::move(partner));
  }
  std::optional<std::pair<First, Second>> AddSecond(absl::Time stamp, Second message) {
    std::optional<First> partner = Add(stamp, &message, &second_, &first_);
    if (!partner) return std::nullopt;
    return std::pair(*std::move(partner), std::move(message));
  }

  // Numbers of messages that have left without a partner.
  int64_t num_first_unpaired() const { return first_.num_unpaired; }
  int64_t num_second_unpaired() const { return second_.num_unpaired; }

 private:
  static constexpr absl::Duration kSetBack = absl::Seconds(10);

  template <typename Message>
  struct Waiting {
    absl::Time stamp;
    Message message;
  };
  template <typename Message>
  struct Queue {
    std::vector<Waiting<Message>> waiting;  // in the order of their arrival
    int64_t num_unpaired = 0;
  };

  static constexpr auto kIsOlder = [](const auto& a, const auto& b) { return a.stamp < b.stamp; };

  template <typename Mine, typename Other>
  std::optional<Other> Add(absl::Time stamp, Mine* message, Queue<Mine>* mine,
                           Queue<Other>* others) {
    DropFuture(stamp, mine);
    DropFuture(stamp, others);
    const auto distance = [&](const auto& other) { return absl::AbsDuration(other.stamp - stamp); };
    const auto nearest =
        std::min_element(others->waiting.begin(), others->waiting.end(),
                         [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    if (nearest != others->waiting.end() && distance(*nearest) <= slop_) {
      std::optional<Other> partner = std::move(nearest->message);
      others->waiting.erase(nearest);
      return partner;
    }
    Keep(stamp, std::move(*message), mine);
    return std::nullopt;
  }

  template <typename Message>
  void Keep(absl::Time stamp, Message message, Queue<Message>* queue) {
    auto& waiting = queue->waiting;
    const size_t before = waiting.size();
    // A message replaces one with the same stamp.
    std::erase_if(waiting, [&](const auto& w) { return w.stamp == stamp; });
    waiting.push_back({stamp, std::move(message)});
    if (waiting.size() > size_) {
      waiting.erase(std::min_element(waiting.begin(), waiting.end(), kIsOlder));
    }
    queue->num_unpaired += static_cast<int64_t>(before + 1 - waiting.size());
  }

  // Drops messages that are so far ahead of a new one that the clock must have been set back.
  template <typename Message>
  static void DropFuture(absl::Time stamp, Queue<Message>* queue) {
    queue->num_unpaired += static_cast<int64_t>(
        std::erase_if(queue->waiting, [&](const auto& w) { return w.stamp - stamp > kSetBack; }));
  }

  const size_t size_;
  const absl::Duration slop_;
  Queue<First> first_;
  Queue<Second> second_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TIME_SYNCHRONIZER_H_
