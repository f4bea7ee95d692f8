// The explorations of a map: starting them, and sending robots to goals.
#ifndef HYPERMAP_SERVER_EXPLORATION_MAP_EXPLORATIONS_H_
#define HYPERMAP_SERVER_EXPLORATION_MAP_EXPLORATIONS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/metering/memory_meter.h"
#include "base/sync/mutex.h"
#include "map/edits/edit.h"
#include "map/exploration/exploration_objects.h"
#include "map/layers/semantic_layer.h"
#include "map/snapshot.h"
#include "server/exploration/exploration_calls.h"
#include "server/exploration/exploration_follower.h"
#include "server/exploration/exploration_rate.h"
#include "server/exploration/exploration_team.h"
#include "storage/map_store.h"

namespace hypermap::server {

class MapSession;

// Carries out the calls of ExplorationService for one map.
//
// The state is the objects of the layer "explorations" in the newest snapshot. Each call reads it
// again. A call that changes it is one commit, which requires the layer's version and is retried if
// another writer changed the layer meanwhile. Memory holds only what can be computed or asked
// again: Explorers, which follow the map; the last positions of robots; the floor that was looked
// at in vain; and rates. After a restart, robots report their positions again, and the rest is
// lost. A goal whose lease has ended counts as gone even if the writer has not removed it yet.
//
// Thread safe. Calls wait for each other, for the disk, and for the Explorer's computations. Errors
// of all calls: NOT_FOUND for an exploration or frame; FAILED_PRECONDITION if a layer is gone or of
// another kind; DATA_LOSS if the objects were edited so that they can't be read; those of
// MapSession::Submit.
class MapExplorations {
 public:
  // `session` must outlive this.
  MapExplorations(MapSession* session, const ExplorationRoom& room)
      : session_(session), room_(room) {}
  MapExplorations(const MapExplorations&) = delete;
  MapExplorations& operator=(const MapExplorations&) = delete;

  // Starts an exploration and creates the layers that are missing. INVALID_ARGUMENT naming the
  // field; NOT_FOUND for the occupancy layer; FAILED_PRECONDITION if the area has no floor;
  // RESOURCE_EXHAUSTED if the area is too large, explorations already fill
  // --max_exploration_bytes, or FixedLimits::kMaxActiveExplorations are active.
  absl::StatusOr<ExplorationView> Start(const ExplorationStart& request);

  // An exploration with its progress. If it has ended, the progress is that at its end; if it ended
  // before a restart, the progress is computed from the map as it is now.
  absl::StatusOr<ExplorationReport> Get(ObjectId id, const std::string& frame_id);
  absl::StatusOr<ExplorationList> List(const std::string& frame_id) const;
  // FAILED_PRECONDITION if the exploration has ended.
  absl::StatusOr<FrontierList> ListFrontiers(ObjectId id, const std::string& frame_id);

  // Gives the robot a goal, instead of the one it may have. Ends the exploration if no robot has
  // anything left to do. FAILED_PRECONDITION if the robot stands where it can't go.
  absl::StatusOr<ClaimAnswer> Claim(const GoalClaim& request);
  // Extends the lease of a goal. NOT_FOUND if the robot does not hold it.
  absl::StatusOr<GoalAnswer> Renew(const GoalRenewal& request);
  // Gives a goal back, and notes a place that could not be reached. NOT_FOUND as Renew.
  absl::StatusOr<ExplorationAnswer> Release(const GoalRelease& request);

  // Ends an exploration; changes nothing if it has ended.
  absl::StatusOr<ExplorationView> Stop(ObjectId id, const std::string& author);

 private:
  static constexpr int kAttempts = 8;

  // The state in memory of an exploration that has not ended.
  struct Active {
    explicit Active(const ExplorationRoom& room) : follower(room) {}

    ExplorationFollower follower;
    ExplorationTeam team;
    ExplorationRate rate;
  };
  // An exploration as it is in `snapshot`, without goals whose lease has ended.
  struct Kept {
    SnapshotPtr snapshot;
    std::shared_ptr<const SemanticLayer> layer;
    ExplorationObjects objects;
  };

  // A new exploration, computed on a snapshot that is not committed yet.
  struct Trial {
    ExplorationObjects objects;
    std::unique_ptr<Active> active;
  };

  absl::StatusOr<Kept> Read(ObjectId id) const;
  // The goal and its exploration. NOT_FOUND if the robot does not hold the goal.
  absl::StatusOr<Kept> ReadGoal(const std::string& robot, ObjectId goal_id,
                                ExplorationGoal* goal) const;
  void DropEndedLeases(const SemanticLayer& layer, ExplorationObjects* objects) const;
  // A clock that no setting of the wall clock affects, for intervals.
  absl::Time PassedTime() const;

  // The state of an active exploration, updated to the snapshot of `kept`. Drops the states of
  // explorations that have ended.
  absl::StatusOr<Active*> Follow(const Kept& kept) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void LetGo(const SemanticLayer& layer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The progress, which also becomes a sample of the rate.
  ExplorationProgress Measure(Active* active) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Keeps the progress of an exploration that has ended.
  void Remember(ObjectId ended, ExplorationProgress progress) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationProgress> Progress(const Kept& kept)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationProgress> EndedProgress(const Kept& kept)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  // Commits the edits. ABORTED if the layer "explorations" has changed since `kept` was read.
  absl::StatusOr<storage::Receipt> Commit(const Kept& kept, std::vector<Edit> edits,
                                          const std::string& author)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  // Repeats an attempt while it is ABORTED because another writer changed the layer meanwhile.
  template <typename Attempt>
  static auto Retried(Attempt attempt) {
    const auto try_once = [&attempt] {
      const TemporaryMemory copies;  // of the layer, which end with the attempt
      return attempt();
    };
    auto answer = try_once();
    for (int i = 1; i < kAttempts && absl::IsAborted(answer.status()); ++i) answer = try_once();
    return answer;
  }

  absl::StatusOr<ExplorationView> TryStart(const ExplorationStart& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Applies `batch` to `snapshot` without committing it, so that an exploration that can't be
  // started leaves no trace on the map.
  absl::StatusOr<Trial> Try(const Snapshot& snapshot, const EditBatch& batch) const;
  // The answer to an earlier request with the same id; nullopt if there was none.
  absl::StatusOr<std::optional<ExplorationView>> FindStarted(const ExplorationStart& request) const;
  absl::StatusOr<ClaimAnswer> TryClaim(const GoalClaim& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Records the robot's position.
  absl::Status Meet(const GoalClaim& request, const PlanarTransform& frame_from_layer,
                    Active* active) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // The robot's next goal, which is not on the map yet; nullopt if there is nothing for the robot.
  static std::optional<ExplorationGoal> ChooseGoal(const std::string& robot,
                                                   const ExplorationObjects& objects,
                                                   Active* active);
  // The goal with its id, and its end as the map has it.
  ExplorationGoal AsPut(ExplorationGoal goal, ObjectId id, absl::Duration lease) const;
  absl::StatusOr<GoalAnswer> TryRenew(const GoalRenewal& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationAnswer> TryRelease(const GoalRelease& request)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationView> TryStop(ObjectId id, const std::string& author)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Adds the edits that end the exploration to `edits`, and makes the same changes to `kept`.
  void End(EndReason reason, Kept* kept, std::vector<Edit>* edits) const;

  MapSession* const session_;
  const ExplorationRoom room_;
  Mutex mutex_;
  std::map<ObjectId, std::unique_ptr<Active>> active_ ABSL_GUARDED_BY(mutex_);
  // Progress of explorations at their end; the newest ids.
  std::map<ObjectId, ExplorationProgress> ended_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_MAP_EXPLORATIONS_H_
