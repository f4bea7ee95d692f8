#include "client_libs/ros2/bridge/map_bridge.h"

#include <atomic>
#include <utility>

#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "client_libs/cpp/replica/replica.h"
#include "client_libs/ros2/bridge/shown_map.h"

namespace hypermap::ros2 {
namespace {

// Between looks for a map or a server that is not there.
constexpr absl::Duration kBetweenAttempts = absl::Seconds(1);
// The longest wait for a change, after which it is looked for other reasons to act.
constexpr absl::Duration kLongestWait = absl::Milliseconds(100);

}  // namespace

class MapBridge::Loop {
 public:
  Loop(Participant* participant, client::Client client, MapBridgeOptions options)
      : participant_(participant), client_(std::move(client)), options_(std::move(options)) {}

  void End() { ends_ = true; }

  std::optional<absl::Duration> Step() {
    if (ends_) return std::nullopt;
    const absl::Status status = replica_ == nullptr ? Open() : Follow();
    if (status == problem_) return status.ok() ? absl::ZeroDuration() : kBetweenAttempts;
    problem_ = status;
    if (status.ok()) return absl::ZeroDuration();
    logging::Log(logging::Level::kWarning, "a map is not shown",
                 {{"map", options_.map}, {"problem", status.ToString()}});
    return kBetweenAttempts;
  }

 private:
  absl::Status Open() {
    HYPERMAP_ASSIGN_OR_RETURN(replica_, client::Replica::Open(client_, {.map = options_.map}));
    logging::Log(logging::Level::kInfo, "a map is shown",
                 {{"map", options_.map}, {"revision", replica_->snapshot()->revision}});
    return Follow();
  }

  // Shows the newest snapshot, and waits for the next one.
  absl::Status Follow() {
    const client::ReplicaState state = replica_->state();
    if (absl::IsNotFound(state.problem)) {
      // The map was deleted. What was latched goes with its topics.
      shown_ = nullptr;
      replica_ = nullptr;
      return state.problem;
    }
    const SnapshotPtr snapshot = replica_->snapshot();
    if (shown_ == nullptr) {
      HYPERMAP_ASSIGN_OR_RETURN(shown_, ShownMap::Make(participant_, client_, options_, snapshot));
    }
    HYPERMAP_RETURN_IF_ERROR(shown_->Show(snapshot));
    shown_->Refresh();
    // Its error says only that nothing has come. Another incarnation may begin with any revision.
    replica_->AwaitRevision(snapshot->revision + 1, kLongestWait).IgnoreError();
    return absl::OkStatus();
  }

  Participant* const participant_;
  const client::Client client_;
  const MapBridgeOptions options_;
  std::atomic<bool> ends_ = false;
  std::unique_ptr<client::Replica> replica_;
  std::unique_ptr<ShownMap> shown_;
  absl::Status problem_;
};

absl::StatusOr<std::unique_ptr<MapBridge>> MapBridge::Start(Participant* participant,
                                                            client::Client client,
                                                            MapBridgeOptions options) {
  auto loop = std::make_unique<Loop>(participant, std::move(client), std::move(options));
  std::unique_ptr<MapBridge> bridge(new MapBridge(std::move(loop)));
  HYPERMAP_ASSIGN_OR_RETURN(
      bridge->running_,
      ThreadExecutor().Start("hm-ros2-map", [loop = bridge->loop_.get()] { return loop->Step(); }));
  return bridge;
}

MapBridge::MapBridge(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}

MapBridge::~MapBridge() {
  loop_->End();
  if (running_ == nullptr) return;
  running_->Wake();
  running_->Join();
}

}  // namespace hypermap::ros2
