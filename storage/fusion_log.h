// What is kept of a fused layer beside its objects: the log of evidence that they are made of.
#ifndef HYPERMAP_STORAGE_FUSION_LOG_H_
#define HYPERMAP_STORAGE_FUSION_LOG_H_

#include <compare>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/layers/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap::storage {

// How a layer is fused.
struct FusionSettings {
  std::string strategy;
  std::string parameters;
  std::string exploration_layer;  // empty: none

  friend bool operator==(const FusionSettings&, const FusionSettings&) = default;
};

// The place of an entry in a layer's log. An observation has number 0. What an operator said comes
// after the newest observation of its time (none: a stamp before all, no robot), numbered from 1
// on in the order it was said.
struct LogKey {
  ObservationKey after;
  int64_t number = 0;

  friend std::strong_ordering operator<=>(const LogKey&, const LogKey&) = default;
};

// Before all keys of entries.
inline LogKey BeforeAll() {
  return {{absl::FromUnixNanos(std::numeric_limits<int64_t>::min()), "", -1}, 0};
}

// An observation that was accepted. The body is whatever the caller made of it.
struct LoggedObservation {
  ObservationKey key;
  // Of what was sent: tells the same observation from another one by its name.
  uint64_t content_hash = 0;
  absl::Time received_at;
  std::string body;
};

// What an operator said. `kind` and `body` are the caller's.
struct LoggedFact {
  LogKey key;
  std::string kind;
  std::string track;
  std::string body;
};

// An entry read back: a fact when key.number > 0.
struct LogEntry {
  LogKey key;
  std::string kind;
  std::string track;
  std::string body;
};

// A state of the fold over all entries up to `key`, that one included.
struct FusionCheckpoint {
  LogKey key;
  std::string state;
};

// Which object of the layer a track is; kept also while the layer does not show it. Object 0: none
// any more.
using TrackId = std::pair<std::string, ObjectId>;

// What a commit does to a fused layer. All of it is stored with the commit or nothing.
struct FusionChange {
  std::string layer;
  // The layer's from now on. Must be set in the first change of a layer.
  std::optional<FusionSettings> settings;
  std::vector<LoggedObservation> observations;
  std::vector<ObservationKey> retracted;
  std::vector<LoggedFact> facts;
  std::vector<TrackId> tracks;
  // Checkpoints at or after this key are no longer true.
  std::optional<LogKey> stale_from;
};

// Reads what FusionChanges wrote. One thread at a time. Errors: DATA_LOSS naming what is damaged;
// UNAVAILABLE.
class FusionLog {
 public:
  virtual ~FusionLog() = default;

  // All fused layers.
  virtual absl::StatusOr<std::vector<std::pair<std::string, FusionSettings>>> FusedLayers() = 0;

  virtual absl::StatusOr<std::vector<TrackId>> Tracks(const std::string& layer) = 0;

  struct Known {
    ObservationKey key;
    uint64_t content_hash = 0;
    bool retracted = false;
  };
  // The observation with this name, retracted or not.
  virtual absl::StatusOr<std::optional<Known>> FindObservation(const std::string& layer,
                                                               const std::string& robot,
                                                               int64_t sequence) = 0;
  // All sequences of a robot, retracted or not, ascending.
  virtual absl::StatusOr<std::vector<int64_t>> Sequences(const std::string& layer,
                                                         const std::string& robot) = 0;
  // Observations of a robot with from <= stamp < to that are not retracted, by key.
  virtual absl::StatusOr<std::vector<ObservationKey>> KeysOf(const std::string& layer,
                                                             const std::string& robot,
                                                             absl::Time from, absl::Time to) = 0;
  // The newest observation that is not retracted; the newest fact, which has the greatest number.
  virtual absl::StatusOr<std::optional<ObservationKey>> NewestKey(const std::string& layer) = 0;
  virtual absl::StatusOr<std::optional<LogKey>> NewestFact(const std::string& layer) = 0;

  // The entries after `after`, by key, at most `max_entries`, without retracted observations.
  virtual absl::StatusOr<std::vector<LogEntry>> Read(const std::string& layer, const LogKey& after,
                                                     int max_entries) = 0;

  // The newest checkpoint before `before` (nullopt: of all).
  virtual absl::StatusOr<std::optional<FusionCheckpoint>> FindCheckpoint(
      const std::string& layer, const std::optional<LogKey>& before) = 0;
  // Keeps a checkpoint, which must be true of what is stored, and forgets all but the newest few.
  virtual absl::Status KeepCheckpoint(const std::string& layer,
                                      const FusionCheckpoint& checkpoint) = 0;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_FUSION_LOG_H_
