// The log of one fused layer: its stored entries, and the changes of the current group commit.
#ifndef HYPERMAP_SERVER_FUSION_EVIDENCE_LOG_H_
#define HYPERMAP_SERVER_FUSION_EVIDENCE_LOG_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/fusion/strategy.h"
#include "server/fusion/evidence.h"
#include "server/fusion/fusion_options.h"
#include "server/fusion/pose_corrections.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// Entries are ordered by key, not by arrival. The newest entries are kept decoded in memory, so
// that an observation that is a little late is folded without reading the store; older ones are
// read from the store when needed. Changes are visible at once, but the store has them only after
// Written. Not thread safe.
class EvidenceLog {
 public:
  // `stored` and `codec` must outlive this.
  static absl::StatusOr<EvidenceLog> Open(std::string layer, storage::FusionLog* stored,
                                          const EvidenceCodec* codec);

  // The newest stamp of a robot's observations, without retracted ones; nullopt if there is none.
  // Costs as FusionLog::NewestStamp the first time that a robot is asked for and after a retraction
  // of its observations, and mostly little otherwise.
  absl::StatusOr<std::optional<absl::Time>> NewestStamp(const std::string& robot);

  // The observation with this name, retracted or forgotten or not; nullopt if there is none.
  absl::StatusOr<std::optional<storage::FusionLog::Known>> FindObservation(const std::string& robot,
                                                                           int64_t sequence) const;

  // The sequence numbers of a robot's stored observations, ascending. Errors as
  // FusionLog::Sequences.
  absl::StatusOr<std::vector<SequenceRange>> Sequences(const std::string& robot) const;

  // Adds an observation in the layer's frame, without corrections. REQUIRES: the log has no entry
  // with its key.
  void Add(std::shared_ptr<const Observation> observation, storage::LoggedObservation logged);
  // Adds a fact that an operator stated, after all other entries. Returns its key.
  storage::LogKey Add(std::shared_ptr<const fusion::OperatorFact> fact);
  // Removes the observations of a robot with from <= stamp < to. Returns their keys, in order.
  // FAILED_PRECONDITION if some of them may be forgotten.
  absl::StatusOr<std::vector<ObservationKey>> Retract(const std::string& robot, absl::Time from,
                                                      absl::Time to);
  // Adds a correction, in the layer's frame, after all other entries; it corrects the observations
  // of its robot that precede it in the log, also those that come later. Returns their keys, in
  // order; if there are none, nothing is added.
  // FAILED_PRECONDITION if some of them may be forgotten.
  absl::StatusOr<std::vector<ObservationKey>> Correct(const PoseCorrection& correction);
  // The corrections. Observations of the log, and those that it is about to get, are stored without
  // them.
  const PoseCorrections& corrections() const { return corrections_; }

  // The observation with this key, as the corrections leave it. It may have been retracted since
  // the last Written. DATA_LOSS if it is not in the log.
  absl::StatusOr<std::shared_ptr<const Observation>> Get(const ObservationKey& key) const;

  // Calls `visit` with the entries after `after`, in order, until it returns false; observations
  // are as the corrections leave them. REQUIRES: `after` is not before begin(). DATA_LOSS for a
  // damaged entry; errors of CheckCancelled, also if only the last visit was given up.
  absl::Status Visit(const storage::LogKey& after,
                     absl::FunctionRef<bool(const Evidence&)> visit) const;

  // The key after which the log has its entries: that of its base, or BeforeAll.
  const storage::LogKey& begin() const { return begin_; }
  // The store has moved the base of the log. REQUIRES: there are no changes since the last Written.
  void BeginAfter(const storage::LogKey& base);

  // Moves the changes since the last call into `change`.
  void TakeChange(storage::FusionChange* change);
  // Must be called when all changes that were taken are stored.
  void Written();

 private:
  using Name = std::pair<std::string, int64_t>;  // robot, sequence

  EvidenceLog(std::string layer, storage::FusionLog* stored, const EvidenceCodec* codec)
      : layer_(std::move(layer)), stored_(stored), codec_(codec) {}

  // Refuses what may concern observations of the robot since `from` that are no longer kept. `what`
  // continues "observations of robot X can be".
  absl::Status CheckKept(const std::string& robot, absl::Time from, absl::string_view what) const;
  // The observations of a robot with from <= stamp < to that are not retracted.
  absl::StatusOr<std::set<ObservationKey>> KeysOf(const std::string& robot, absl::Time from,
                                                  absl::Time to) const;

  // An entry that is kept in memory.
  struct Recent {
    Evidence stored;
    // The observation as the corrections leave it; null until it is asked for.
    mutable std::shared_ptr<const Observation> corrected = nullptr;
  };
  std::shared_ptr<const Observation> Corrected(const Recent& recent) const;

  // Decodes an entry of the store; nullopt if it is retracted, which the store may not know yet.
  absl::StatusOr<std::optional<Evidence>> Decode(const storage::LogEntry& entry) const;

  std::string layer_;
  storage::FusionLog* stored_;
  const EvidenceCodec* codec_;

  // A cache: answers of NewestStamp. Names are chosen by clients, so that it is emptied when it has
  // kMaxNewestStamps.
  std::map<std::string, std::optional<absl::Time>> newest_stamps_;
  storage::LogKey begin_ = storage::BeforeAll();
  // Upper bound of all keys; facts are added after it.
  storage::LogKey last_ = storage::BeforeAll();
  int64_t num_facts_ = 0;  // number of the newest fact
  PoseCorrections corrections_;
  // A cache: all entries after complete_after_, and all that are not stored yet. Observations are
  // as stored, without corrections.
  std::map<storage::LogKey, Recent> recent_;
  storage::LogKey complete_after_ = storage::BeforeAll();

  // Changes since the last TakeChange, and names and retractions since the last Written, which the
  // store does not know yet.
  storage::FusionChange change_;
  std::map<Name, uint64_t> added_;
  std::set<ObservationKey> retracted_;
  // The newest stamp, of those not retracted, of each robot in `added_`; and the robots in
  // `retracted_`.
  std::map<std::string, absl::Time> added_stamps_;
  std::set<std::string> retracted_robots_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_EVIDENCE_LOG_H_
