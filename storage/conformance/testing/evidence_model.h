// The log of evidence of one fused layer as plain containers, to which tests compare stored logs.
#ifndef HYPERMAP_STORAGE_CONFORMANCE_TESTING_EVIDENCE_MODEL_H_
#define HYPERMAP_STORAGE_CONFORMANCE_TESTING_EVIDENCE_MODEL_H_

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/fusion_log.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {

class EvidenceModel {
 public:
  // A random change that the log can take; with settings if it has none.
  FusionChange RandomChange(hypermap::testing::Rng& rng, const std::string& layer) const;
  void Apply(const FusionChange& change);

  // A checkpoint after the base, and the keys of those that it replaces.
  std::pair<FusionCheckpoint, std::vector<LogKey>> RandomCheckpoint(
      hypermap::testing::Rng& rng) const;
  void Keep(const FusionCheckpoint& checkpoint, const std::vector<LogKey>& dropped);
  std::optional<FusionCheckpoint> NextBase(absl::Time stored_before) const;
  // REQUIRES: there is a checkpoint with this key.
  void MoveBase(const LogKey& checkpoint);
  // The entries up to the base are removed. Before that, methods of the log may return them.
  void RemoveForgotten();

  const std::optional<FusionSettings>& settings() const { return settings_; }

  // Expects all that `log` tells of the layer, in random parts.
  void ExpectSame(hypermap::testing::Rng& rng, FusionLog& log, const std::string& layer) const;

 private:
  using Name = std::pair<std::string, int64_t>;  // robot, sequence
  struct Stored {
    LoggedObservation observation;
    bool retracted = false;
  };

  // Whether all entries up to the base are removed.
  bool is_settled() const { return !base_ || is_settled_; }
  bool IsForgotten(const LogKey& key) const { return base_ && key <= base_->key; }
  // The key of the newest entry that counts: new facts come after it.
  LogKey Last() const;
  LogKey RandomKey(hypermap::testing::Rng& rng) const;
  void AddObservations(hypermap::testing::Rng& rng, FusionChange* change) const;
  // The entries that are not retracted or forgotten, in order.
  std::vector<LogEntry> Entries() const;
  std::vector<ObservationKey> KeysOf(const std::string& robot, absl::Time from,
                                     absl::Time to) const;

  void ExpectSameNames(hypermap::testing::Rng& rng, FusionLog& log, const std::string& layer) const;
  void ExpectSameNewest(FusionLog& log, const std::string& layer) const;
  void ExpectSameEntries(hypermap::testing::Rng& rng, FusionLog& log,
                         const std::string& layer) const;
  void ExpectSameCheckpoints(hypermap::testing::Rng& rng, FusionLog& log,
                             const std::string& layer) const;

  std::optional<FusionSettings> settings_;
  std::map<Name, Stored> observations_;
  std::set<Name> forgotten_;
  std::map<LogKey, LoggedFact> facts_;
  std::map<std::string, ObjectId> tracks_;
  std::map<LogKey, FusionCheckpoint> checkpoints_;
  std::optional<FusionBase> base_;
  int64_t num_facts_ = 0;
  bool is_settled_ = true;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_CONFORMANCE_TESTING_EVIDENCE_MODEL_H_
