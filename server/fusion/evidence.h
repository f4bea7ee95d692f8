// The entries of a layer's log as fusion takes them, and as bytes.
#ifndef HYPERMAP_SERVER_FUSION_EVIDENCE_H_
#define HYPERMAP_SERVER_FUSION_EVIDENCE_H_

#include <memory>

#include "absl/status/statusor.h"
#include "map/fusion/strategy.h"
#include "server/fusion/fusion_options.h"
#include "storage/fusion_log.h"

namespace hypermap::server {

// One of the two is set.
struct Evidence {
  storage::LogKey key;
  std::shared_ptr<const Observation> observation;  // in the layer's frame
  std::shared_ptr<const fusion::OperatorFact> fact;
};

// DATA_LOSS naming the entry that is damaged.
absl::StatusOr<Evidence> DecodeEvidence(const storage::LogEntry& entry, const EvidenceCodec& codec);

storage::LoggedFact EncodeFact(const storage::LogKey& key, const fusion::OperatorFact& fact,
                               const EvidenceCodec& codec);

// The state after an entry. `report` may be null, and is filled for observations.
fusion::StatePtr Fold(const fusion::Strategy& strategy, const fusion::StatePtr& state,
                      const Evidence& evidence, fusion::FoldReport* report);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FUSION_EVIDENCE_H_
