// The entries of a fused layer's log, and their encoding.
#ifndef HYPERMAP_SERVER_FUSION_EVIDENCE_H_
#define HYPERMAP_SERVER_FUSION_EVIDENCE_H_

#include <memory>

#include "absl/status/statusor.h"
#include "map/fusion/strategy.h"
#include "server/fusion/fusion_options.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// An entry of the log: one of the three is set, the others are null.
struct Evidence {
  storage::LogKey key;
  // In the layer's frame. A stored one may be relative to its view; Fold takes placed ones.
  std::shared_ptr<const Observation> observation;
  std::shared_ptr<const fusion::OperatorFact> fact;
  // Changes observations that precede it in the log, which EvidenceLog has done; no state.
  std::shared_ptr<const PoseCorrection> correction;  // in the layer's frame
};

// The kind of a LoggedFact that is a correction.
inline constexpr char kPosesKind[] = "poses";

// DATA_LOSS naming the entry if it is damaged.
absl::StatusOr<Evidence> DecodeEvidence(const storage::LogEntry& entry, const EvidenceCodec& codec);

// Checks stored entries by decoding them. Null if the codec is empty.
storage::EvidenceCheck CheckBy(const EvidenceCodec& codec);

storage::LoggedFact EncodeFact(const storage::LogKey& key, const fusion::OperatorFact& fact,
                               const EvidenceCodec& codec);
storage::LoggedFact EncodeFact(const storage::LogKey& key, const PoseCorrection& correction,
                               const EvidenceCodec& codec);

// Returns the state after the entry. `report` may be null; only observations fill it.
fusion::StatePtr Fold(const fusion::Strategy& strategy, const fusion::StatePtr& state,
                      const Evidence& evidence, fusion::FoldReport* report);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_EVIDENCE_H_
