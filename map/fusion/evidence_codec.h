// The evidence strategy's state as bytes.
#ifndef HYPERMAP_MAP_FUSION_EVIDENCE_CODEC_H_
#define HYPERMAP_MAP_FUSION_EVIDENCE_CODEC_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/evidence_state.h"

namespace hypermap::fusion {

std::string EncodeEvidence(const EvidenceState& state);

// What follows from the evidence is computed anew. DATA_LOSS.
absl::StatusOr<std::shared_ptr<const EvidenceState>> DecodeEvidence(
    absl::string_view bytes, const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_CODEC_H_
