// The interface to the log of evidence of fused layers, from which their objects are computed.
#ifndef HYPERMAP_STORAGE_FUSION_LOG_H_
#define HYPERMAP_STORAGE_FUSION_LOG_H_

#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"
#include "map/observations/observe_answers.h"

namespace hypermap::storage {

// The settings of a fused layer.
struct FusionSettings {
  std::string strategy;
  std::string parameters;
  std::string exploration_layer;  // empty: none

  friend bool operator==(const FusionSettings&, const FusionSettings&) = default;
};

// The place of an entry in a layer's log. An observation has number 0. A fact that an operator
// stated comes after the newest observation at that time (or after BeforeAll when there was none);
// facts are numbered from 1 on, in their order.
struct LogKey {
  ObservationKey after;
  int64_t number = 0;

  friend std::strong_ordering operator<=>(const LogKey&, const LogKey&) = default;
};

// A key before those of all entries.
inline LogKey BeforeAll() {
  return {{absl::FromUnixNanos(std::numeric_limits<int64_t>::min()), "", -1}, 0};
}

// An accepted observation. The encoding of the body is the caller's.
struct LoggedObservation {
  ObservationKey key;
  // Hash of the message as sent: distinguishes a retry from another observation with the same name.
  uint64_t content_hash = 0;
  absl::Time received_at;
  std::string body;
};

// A fact that an operator stated. The meaning of `kind` and the encoding of `body` are the
// caller's.
struct LoggedFact {
  LogKey key;
  std::string kind;
  std::string track;
  std::string body;
};

// An entry read from the log: a fact when key.number > 0, else an observation.
struct LogEntry {
  LogKey key;
  std::string kind;
  std::string track;
  std::string body;
};

// Decodes an entry, and tells whether that is possible: DATA_LOSS if it is not.
using EvidenceCheck = std::function<absl::Status(const LogEntry&)>;

// The state of the fold over all entries up to and including `key`.
struct FusionCheckpoint {
  LogKey key;
  std::string state;
  // When it was stored, by the clock of commit times: all its entries had been received by then.
  absl::Time stored_at;
};

// Where a log begins whose older entries are no longer kept: the state of the fold over all entries
// up to and including `key`. Other than a checkpoint it can't be computed again.
struct FusionBase {
  LogKey key;
  int64_t num_facts = 0;  // the number of the newest fact up to `key`; 0: there was none
  std::string state;
};

// A track and the object of the layer that shows it. The id stays reserved while the layer does not
// show the track; 0: the track has no object any more.
using TrackId = std::pair<std::string, ObjectId>;

// Names of observations of a robot that are no longer kept.
struct ForgottenNames {
  std::string robot;
  SequenceRange sequences;

  friend bool operator==(const ForgottenNames&, const ForgottenNames&) = default;
};

// The changes of a commit to the log of one fused layer. They are stored in the same transaction.
struct FusionChange {
  std::string layer;
  // The new settings of the layer. REQUIRED in the first change of a layer.
  std::optional<FusionSettings> settings;
  std::vector<LoggedObservation> observations;
  std::vector<ObservationKey> retracted;
  std::vector<LoggedFact> facts;
  std::vector<TrackId> tracks;
  // Checkpoints at or after this key are invalid and removed.
  std::optional<LogKey> stale_from;
  // The rest is for copies of logs only (StoredMap::AddCopied). The base replaces the one before.
  std::optional<FusionBase> base;
  // REQUIRES: ranges of a robot neither overlap nor continue each other, or those that the log has.
  std::vector<ForgottenNames> forgotten;
};

// Reads the log that FusionChanges have written. One thread at a time. Errors of all methods:
// DATA_LOSS naming the damaged table and row; UNAVAILABLE.
//
// Entries up to the base of a log are forgotten. StoredMap::Compact removes them little by little;
// until then methods may still return them. Of the forgotten observations the names are kept, so
// that none of them is taken for a new one: FindObservation and Sequences know them.
class FusionLog {
 public:
  virtual ~FusionLog() = default;

  // The names and settings of all fused layers.
  virtual absl::StatusOr<std::vector<std::pair<std::string, FusionSettings>>> FusedLayers() = 0;

  virtual absl::StatusOr<std::vector<TrackId>> Tracks(const std::string& layer) = 0;

  struct Known {
    std::optional<uint64_t> content_hash;  // nullopt if only the name is kept
    bool retracted = false;
  };
  // The observation with this name, retracted or not; nullopt when there is none.
  virtual absl::StatusOr<std::optional<Known>> FindObservation(const std::string& layer,
                                                               const std::string& robot,
                                                               int64_t sequence) = 0;
  // The sequence numbers of all observations of a robot, retracted or not, ascending. Linear in
  // their number. Errors also of CheckCancelled and TakeMemory.
  virtual absl::StatusOr<std::vector<SequenceRange>> Sequences(const std::string& layer,
                                                               const std::string& robot) = 0;
  // The observations of a robot with from <= stamp < to that are not retracted, ordered by key.
  virtual absl::StatusOr<std::vector<ObservationKey>> KeysOf(const std::string& layer,
                                                             const std::string& robot,
                                                             absl::Time from, absl::Time to) = 0;
  // The newest stamp of a robot's observations that are not retracted; nullopt when there is none.
  // Costs a step for each observation of the robot, or for each observation of the layer with a
  // newer stamp, whichever are fewer.
  virtual absl::StatusOr<std::optional<absl::Time>> NewestStamp(const std::string& layer,
                                                                const std::string& robot) = 0;
  // The key of the newest observation that is not retracted, and that of the newest fact, which has
  // the greatest number.
  virtual absl::StatusOr<std::optional<ObservationKey>> NewestKey(const std::string& layer) = 0;
  virtual absl::StatusOr<std::optional<LogKey>> NewestFact(const std::string& layer) = 0;
  // All facts of a kind, ordered by key. Costs a step for each fact of the layer.
  virtual absl::StatusOr<std::vector<LogEntry>> FactsOfKind(const std::string& layer,
                                                            const std::string& kind) = 0;

  // At most `max_entries` entries after `after`, ordered by key, without retracted observations.
  virtual absl::StatusOr<std::vector<LogEntry>> Read(const std::string& layer, const LogKey& after,
                                                     int max_entries) = 0;

  // An entry with all that is stored of it.
  struct StoredEntry {
    LogEntry entry;
    // Of an observation only; as in LoggedObservation and Known.
    uint64_t content_hash = 0;
    absl::Time received_at;
    bool retracted = false;
  };
  // As Read, with the retracted observations.
  virtual absl::StatusOr<std::vector<StoredEntry>> ReadStored(const std::string& layer,
                                                              const LogKey& after,
                                                              int max_entries) = 0;
  // At most `max_count` ranges of names whose entries are removed, ordered by robot and sequence:
  // those after the range `after`, of which the end is not used; nullopt: from the first one.
  virtual absl::StatusOr<std::vector<ForgottenNames>> Forgotten(
      const std::string& layer, const std::optional<ForgottenNames>& after, int max_count) = 0;

  // The newest checkpoint before `before`; nullopt: the newest of all.
  virtual absl::StatusOr<std::optional<FusionCheckpoint>> FindCheckpoint(
      const std::string& layer, const std::optional<LogKey>& before) = 0;
  struct CheckpointKey {
    LogKey key;
    absl::Time stored_at;
  };
  // All checkpoints, ordered by key.
  virtual absl::StatusOr<std::vector<CheckpointKey>> Checkpoints(const std::string& layer) = 0;
  // Stores a checkpoint and removes those with the keys `dropped`. REQUIRES: it is the state of the
  // stored entries.
  virtual absl::Status KeepCheckpoint(const std::string& layer, const FusionCheckpoint& checkpoint,
                                      absl::Span<const LogKey> dropped) = 0;

  // The base of the log; nullopt while all entries are kept.
  virtual absl::StatusOr<std::optional<FusionBase>> FindBase(const std::string& layer) = 0;
  // Returns whether the log has had observations of the robot up to its base, also retracted ones.
  virtual absl::StatusOr<bool> HasForgotten(const std::string& layer, const std::string& robot) = 0;
  // The checkpoint that can become the base: of those stored before `stored_before` and after the
  // base that the log has, the one with the newest entries. nullopt if there is none.
  virtual absl::StatusOr<std::optional<FusionCheckpoint>> FindNextBase(
      const std::string& layer, absl::Time stored_before) = 0;
  // Makes a checkpoint the base of the log, durably, and removes the checkpoints up to it.
  // REQUIRES: the state can be decoded.
  virtual absl::Status MoveBase(const std::string& layer, const LogKey& checkpoint) = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_FUSION_LOG_H_
