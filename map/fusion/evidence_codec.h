// The state of the evidence strategy as bytes.
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

// Recomputes hulls and shown objects from the decoded evidence, with `parameters`. DATA_LOSS for
// bytes that are not such a state.
absl::StatusOr<std::shared_ptr<const EvidenceState>> DecodeEvidence(
    absl::string_view bytes, const EvidenceParameters& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_EVIDENCE_CODEC_H_
