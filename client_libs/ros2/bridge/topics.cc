#include "client_libs/ros2/bridge/topics.h"

#include <utility>

#include "absl/memory/memory.h"
#include "absl/strings/str_cat.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {

absl::StatusOr<std::unique_ptr<Publisher>> AdvertiseLogged(Participant* participant,
                                                           const std::string& name,
                                                           const std::string& type, TopicQos qos,
                                                           std::atomic<bool>* joined) {
  return participant->Advertise(name, type, qos, [name, joined](const Subscriber& subscriber) {
    if (joined != nullptr && subscriber.joined) *joined = true;
    logging::Log(logging::Level::kInfo,
                 subscriber.joined ? "a subscriber has come" : "a subscriber has gone",
                 {{"topic", name}, {"guid", subscriber.guid}, {"subscribers", subscriber.count}});
  });
}

absl::StatusOr<std::unique_ptr<GridTopic>> GridTopic::Make(Participant* participant,
                                                           const std::string& name, GridMode mode,
                                                           absl::Duration send_again_after) {
  auto topic = absl::WrapUnique(new GridTopic(mode, send_again_after));
  HYPERMAP_ASSIGN_OR_RETURN(topic->grids_,
                            AdvertiseLogged(participant, name, nav_msgs::OccupancyGrid::kType,
                                            TopicQos::kLatched, &topic->joined_));
  HYPERMAP_ASSIGN_OR_RETURN(
      topic->updates_, AdvertiseLogged(participant, absl::StrCat(name, "_updates"),
                                       map_msgs::OccupancyGridUpdate::kType, TopicQos::kReliable));
  return topic;
}

void GridTopic::Show(std::shared_ptr<const GridLayer> layer, absl::Time stamp) {
  if (layer == layer_) return;
  const std::shared_ptr<const GridLayer> before = std::exchange(layer_, std::move(layer));
  stamp_ = stamp;
  if (before == nullptr || !CanUpdate(*before, *layer_)) return SendWhole(stamp);
  const CellBox changed = ChangedCells(*before, *layer_);
  if (changed.empty()) return;
  updates_->Publish(EncodeCdr(ToUpdate(*layer_, changed, mode_, stamp)));
  is_old_ = true;
}

void GridTopic::Refresh() {
  if (!is_old_) return;
  const bool is_due = SteadyTime::Now() - sent_ >= send_again_after_;
  if (joined_.exchange(false) || is_due) SendWhole(stamp_);
}

void GridTopic::SendWhole(absl::Time stamp) {
  // An empty grid is none for nav2.
  if (layer_->extent().empty()) return;
  sent_ = SteadyTime::Now();
  // If it was not taken, it is sent again later.
  is_old_ = !grids_->Publish(EncodeCdr(ToOccupancyGrid(*layer_, mode_, stamp)));
}

}  // namespace hypermap::ros2
