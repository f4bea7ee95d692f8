// The topics of a map, each of which sends what has changed in it.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TOPICS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TOPICS_H_

#include <atomic>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/conversion/grids.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {

// Advertises a topic, and logs who subscribes to it. `joined` is set when somebody has come; it may
// be null, and must outlive the topic.
absl::StatusOr<std::unique_ptr<Publisher>> AdvertiseLogged(Participant* participant,
                                                           const std::string& name,
                                                           const std::string& type, TopicQos qos,
                                                           std::atomic<bool>* joined = nullptr);

// A message that is sent again whenever it changes.
template <typename Message>
class LatchedTopic {
 public:
  static absl::StatusOr<LatchedTopic> Make(Participant* participant, const std::string& name) {
    LatchedTopic topic;
    auto publisher = AdvertiseLogged(participant, name, Message::kType, TopicQos::kLatched);
    if (!publisher.ok()) return publisher.status();
    topic.publisher_ = *std::move(publisher);
    return topic;
  }
  void Publish(const Message& message) { publisher_->Publish(EncodeCdr(message)); }

 private:
  std::unique_ptr<Publisher> publisher_;
};

// A grid layer: the whole grid, latched, and updates of the cells that change.
//
// After updates the latched grid is old. It is sent again when somebody comes, and at the latest
// after a while, for those who do not listen to updates.
class GridTopic {
 public:
  // The updates are on NAME_updates.
  static absl::StatusOr<std::unique_ptr<GridTopic>> Make(Participant* participant,
                                                         const std::string& name, GridMode mode,
                                                         absl::Duration send_again_after);

  // Sends what differs from the layer that was shown before.
  void Show(std::shared_ptr<const GridLayer> layer, absl::Time stamp);
  // Sends the latched grid again if it is due. To be called often.
  void Refresh();

 private:
  GridTopic(GridMode mode, absl::Duration send_again_after)
      : mode_(mode), send_again_after_(send_again_after) {}
  void SendWhole(absl::Time stamp);

  const GridMode mode_;
  const absl::Duration send_again_after_;
  std::atomic<bool> joined_ = false;
  std::unique_ptr<Publisher> grids_;
  std::unique_ptr<Publisher> updates_;
  std::shared_ptr<const GridLayer> layer_;  // as it was shown; null at first
  absl::Time stamp_;
  bool is_old_ = false;  // the latched grid is not that of layer_
  SteadyTime sent_ = SteadyTime::InfinitePast();
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_TOPICS_H_
