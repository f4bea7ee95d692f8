// The log of one fused layer: what is stored of it, and what the group in work adds.
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
#include "storage/fusion_log.h"

namespace hypermap::server {

// Reads from the store what it must and keeps the newest entries decoded, so that an entry that is
// a little late costs no reading. What was added is seen at once; after Written the store is taken
// to have it. One thread.
class EvidenceLog {
 public:
  // Both outlive this.
  static absl::StatusOr<EvidenceLog> Open(std::string layer, storage::FusionLog* stored,
                                          const EvidenceCodec* codec);

  // The newest observation; nullopt when there is none.
  const std::optional<ObservationKey>& newest() const { return newest_; }

  // What was sent under this name, also if retracted since; nullopt: nothing.
  absl::StatusOr<std::optional<uint64_t>> FindContentHash(const std::string& robot,
                                                          int64_t sequence) const;

  // The sequences of a robot that are stored, ascending.
  absl::StatusOr<std::vector<int64_t>> Sequences(const std::string& robot) const;

  // Adds an observation in the layer's frame. Its key is not in the log.
  void Add(std::shared_ptr<const Observation> observation, storage::LoggedObservation logged);
  // Adds what an operator said, after all there is. The key it got.
  storage::LogKey Add(fusion::OperatorFact fact);
  // Takes the observations of a robot with from <= stamp < to out of the log; their keys, in order.
  absl::StatusOr<std::vector<ObservationKey>> Retract(const std::string& robot, absl::Time from,
                                                      absl::Time to);
  // The observation with this key, also one that was just retracted.
  absl::StatusOr<std::shared_ptr<const Observation>> Get(const ObservationKey& key) const;

  // Calls `visit` with every entry after `after`, in order. DATA_LOSS.
  absl::Status Visit(const storage::LogKey& after,
                     absl::FunctionRef<void(const Evidence&)> visit) const;

  // Moves what was added since the last call into `change`.
  void TakeChange(storage::FusionChange* change);
  // All that was taken is stored.
  absl::Status Written();

 private:
  using Name = std::pair<std::string, int64_t>;  // robot, sequence

  EvidenceLog(std::string layer, storage::FusionLog* stored, const EvidenceCodec* codec)
      : layer_(std::move(layer)), stored_(stored), codec_(codec) {}

  // What is visited of an entry that was read from the store; nullopt: nothing.
  absl::StatusOr<std::optional<Evidence>> Decode(const storage::LogEntry& entry) const;

  std::string layer_;
  storage::FusionLog* stored_;
  const EvidenceCodec* codec_;

  std::optional<ObservationKey> newest_;
  // No key of the log is greater.
  storage::LogKey last_ = storage::BeforeAll();
  int64_t num_facts_ = 0;
  // All entries after complete_after_, and all that are not stored yet.
  std::map<storage::LogKey, Evidence> recent_;
  storage::LogKey complete_after_ = storage::BeforeAll();

  // Of the group in work.
  storage::FusionChange change_;
  std::map<Name, uint64_t> added_;
  std::set<ObservationKey> retracted_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_EVIDENCE_LOG_H_
