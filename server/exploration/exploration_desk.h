// The explorations of a map: who starts them, and who is sent where.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_DESK_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_DESK_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
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

// The truth is what the newest snapshot keeps in the layer "explorations"; each call reads it anew,
// and a call that changes it is one commit, which is made again when somebody else changed the
// layer meanwhile. In memory are only Explorers, which follow the map, where robots were last, what
// they tried in vain, and rates: after a restart robots tell again where they are, and the rest is
// lost. A goal whose lease has ended is gone, even if the writer has not removed it yet.
//
// Thread safe; calls wait for each other, for the disk, and for what it takes to look over the
// area. Errors besides those named: NOT_FOUND for an exploration or frame; FAILED_PRECONDITION when
// a layer is gone or of another kind; DATA_LOSS when somebody spoiled the objects; those of
// MapSession::Submit.
class ExplorationDesk {
 public:
  // Of a map.
  static constexpr size_t kMaxActive = 16;

  // `session` outlives this. `max_cells`: the limit of cells in the box round an explored area.
  ExplorationDesk(MapSession* session, int64_t max_cells)
      : session_(session), max_cells_(max_cells) {}
  ExplorationDesk(const ExplorationDesk&) = delete;
  ExplorationDesk& operator=(const ExplorationDesk&) = delete;

  // Makes the layers that are missing. INVALID_ARGUMENT naming the field, NOT_FOUND,
  // FAILED_PRECONDITION when there is no floor, RESOURCE_EXHAUSTED when the area is too large or
  // there are kMaxActive others.
  absl::StatusOr<ExplorationView> Start(const StartOrder& order);

  // Of one that has ended: the progress at its end; computed as the map is now when that was before
  // a restart.
  absl::StatusOr<ExplorationReport> Get(ObjectId id, const std::string& frame_id);
  absl::StatusOr<ExplorationList> List(const std::string& frame_id) const;
  // FAILED_PRECONDITION when it has ended.
  absl::StatusOr<FrontierList> ListFrontiers(ObjectId id, const std::string& frame_id);

  // Ends the exploration when there is nothing left for anybody. FAILED_PRECONDITION when the robot
  // stands where it can't go.
  absl::StatusOr<ClaimAnswer> Claim(const ClaimOrder& order);
  // NOT_FOUND when the robot does not hold the goal.
  absl::StatusOr<GoalAnswer> Renew(const RenewOrder& order);
  absl::StatusOr<ExplorationAnswer> Release(const ReleaseOrder& order);

  absl::StatusOr<ExplorationView> Stop(ObjectId id, const std::string& author);

 private:
  static constexpr int kAttempts = 8;

  // One that goes on.
  struct Active {
    explicit Active(int64_t max_cells) : follower(max_cells) {}

    ExplorationFollower follower;
    ExplorationTeam team;
    ExplorationRate rate;
  };
  // An exploration as the newest snapshot has it, without goals whose lease has ended.
  struct Kept {
    SnapshotPtr snapshot;
    std::shared_ptr<const SemanticLayer> layer;
    ExplorationObjects objects;
  };

  // An exploration on a map as it would be.
  struct Trial {
    ExplorationObjects objects;
    std::unique_ptr<Active> active;
  };

  absl::StatusOr<Kept> Read(ObjectId id) const;
  // The exploration whose goal it is.
  absl::StatusOr<Kept> ReadGoal(const std::string& robot, ObjectId goal_id,
                                ExplorationGoal* goal) const;
  void DropEndedLeases(ExplorationObjects* objects) const;

  // That of an active exploration, brought up to the snapshot; lets those go that have ended.
  absl::StatusOr<Active*> Follow(const Kept& kept) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void LetGo(const SemanticLayer& layer) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  ExplorationProgress Measure(Active* active) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // How far one had come that has ended.
  void Remember(ObjectId ended, ExplorationProgress progress) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationProgress> Progress(const Kept& kept)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationProgress> EndedProgress(const Kept& kept)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  // Unless the layer "explorations" is no more as it was read: ABORTED.
  absl::StatusOr<storage::Receipt> Commit(const Kept& kept, std::vector<Edit> edits,
                                          const std::string& author)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  // Makes an attempt again that somebody else's edit of the layer was in the way of.
  template <typename Attempt>
  static auto Retried(Attempt attempt) {
    auto answer = attempt();
    for (int i = 1; i < kAttempts && absl::IsAborted(answer.status()); ++i) answer = attempt();
    return answer;
  }

  absl::StatusOr<ExplorationView> TryStart(const StartOrder& order)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Errors are why it can't be started so.
  absl::StatusOr<Trial> Try(const Snapshot& snapshot, const EditBatch& batch) const;
  // What the request was answered when it came first; nullopt when it did not.
  absl::StatusOr<std::optional<ExplorationView>> FindStarted(const StartOrder& order) const;
  absl::StatusOr<ClaimAnswer> TryClaim(const ClaimOrder& order)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Notes where the robot is.
  absl::Status Meet(const ClaimOrder& order, const PlanarTransform& frame_from_layer,
                    Active* active) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // One that is not on the map yet; nullopt when there is nothing for the robot.
  static std::optional<ExplorationGoal> ChooseGoal(const std::string& robot,
                                                   const ExplorationObjects& objects,
                                                   Active* active);
  // The goal as it was put with this lease.
  ExplorationGoal AsPut(ExplorationGoal goal, ObjectId id, absl::Duration lease) const;
  absl::StatusOr<GoalAnswer> TryRenew(const RenewOrder& order)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationAnswer> TryRelease(const ReleaseOrder& order)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<ExplorationView> TryStop(ObjectId id, const std::string& author)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Adds what ends the exploration, and makes the objects what they are then.
  void End(EndReason reason, Kept* kept, std::vector<Edit>* edits) const;

  MapSession* const session_;
  const int64_t max_cells_;
  Mutex mutex_;
  std::map<ObjectId, std::unique_ptr<Active>> active_ ABSL_GUARDED_BY(mutex_);
  // Of those that have ended.
  std::map<ObjectId, ExplorationProgress> ended_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_DESK_H_
