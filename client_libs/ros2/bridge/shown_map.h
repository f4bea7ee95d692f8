// The topics and services of a map that is there. Only for the sources of this room.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_SHOWN_MAP_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_SHOWN_MAP_H_

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/bridge/map_bridge.h"
#include "client_libs/ros2/bridge/topics.h"
#include "client_libs/ros2/conversion/masks.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

// Used by one thread; services read the newest snapshot on others.
class ShownMap {
 public:
  // Shows `snapshot`, and answers from it at once. `participant` must outlive the result.
  // UNAVAILABLE if DDS makes no topic or service.
  static absl::StatusOr<std::unique_ptr<ShownMap>> Make(Participant* participant,
                                                        client::Client client,
                                                        const MapBridgeOptions& options,
                                                        SnapshotPtr snapshot);

  // Sends what differs from the snapshot that was shown before.
  absl::Status Show(SnapshotPtr snapshot);
  // Sends what is due by its time.
  void Refresh();

 private:
  // The newest snapshot, for the services; never null.
  class Newest {
   public:
    explicit Newest(SnapshotPtr snapshot) : snapshot_(std::move(snapshot)) {}
    void Set(SnapshotPtr snapshot) {
      const MutexLock lock(&mutex_);
      snapshot_ = std::move(snapshot);
    }
    SnapshotPtr Get() {
      const MutexLock lock(&mutex_);
      return snapshot_;
    }

   private:
    Mutex mutex_;
    SnapshotPtr snapshot_ ABSL_GUARDED_BY(mutex_);
  };

  ShownMap(Participant* participant, client::Client client, const MapBridgeOptions& options,
           SnapshotPtr snapshot);
  absl::Status Open();
  absl::Status ServeQuestions();
  template <typename Service>
  absl::Status ServeQuestion(const std::string& name);
  absl::Status ServeMaps();
  // The name of a topic or service of the node's own.
  std::string OwnName(const std::string& name) const;

  absl::Status ShowGrids(const Snapshot& snapshot, absl::Time stamp);
  // Returns whether there are other objects, or they are elsewhere, than in the snapshot before.
  absl::StatusOr<bool> ShowObjects(const Snapshot& snapshot, bool has_moved, absl::Time stamp);
  void ShowMasks(const Snapshot& snapshot, bool has_zones_changed, absl::Time stamp);

  Participant* const participant_;
  const client::Client client_;
  const MapBridgeOptions options_;
  const std::shared_ptr<Newest> newest_;
  SnapshotPtr shown_;  // null at first
  std::optional<LatchedTopic<tf2_msgs::TFMessage>> frames_;
  std::optional<LatchedTopic<visualization_msgs::MarkerArray>> markers_;
  std::unique_ptr<GridTopic> map_;
  std::map<std::string, std::unique_ptr<GridTopic>> grids_;                        // by layer
  std::map<std::string, LatchedTopic<hypermap_msgs::SemanticMap>> semantic_maps_;  // by layer
  struct MaskTopics {
    LatchedTopic<nav_msgs::OccupancyGrid> mask;
    LatchedTopic<nav2_msgs::CostmapFilterInfo> info;
    std::string mask_name;
    std::vector<int8_t> sent;
  };
  absl::StatusOr<MaskTopics> AdvertiseMask(const std::string& name, const std::string& info);
  static void Send(Mask mask, bool is_moved, MaskTopics* topics);
  std::optional<MaskTopics> keep_out_;
  std::optional<MaskTopics> speed_;
  std::vector<std::unique_ptr<Service>> services_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_BRIDGE_SHOWN_MAP_H_
