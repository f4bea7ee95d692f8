// Observations on the wire, and as the bytes that a log stores.
#ifndef HYPERMAP_WIRE_OBSERVATION_H_
#define HYPERMAP_WIRE_OBSERVATION_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "hypermap/v1/observation.pb.h"
#include "map/observations/observation.h"
#include "map/observations/pose_correction.h"

namespace hypermap::wire {

void EncodeObservation(const Observation& observation, v1::Observation* message);

// Decodes an observation of a request. INVALID_ARGUMENT, too, for cells whose origin is not
// IsWithinBounds. Does not check what Validate(Observation) checks.
absl::StatusOr<Observation> DecodeObservation(absl::string_view field,
                                              const v1::Observation& message, const Limits& limits);

// Encodes an observation as bytes: exact, and equal for equal observations.
std::string ObservationToBytes(const Observation& observation);
// Returns the bytes that version 0.1 made of the observation.
std::string ObservationToBytes01(const Observation& observation);
// DATA_LOSS for bytes that are not an observation. Assumes that polygons are valid.
absl::StatusOr<Observation> ObservationFromBytes(absl::string_view bytes);

void EncodeCorrectedPose(const CorrectedPose& pose, v1::CorrectedPose* message);
// Decodes the poses of a request. Does not check what Validate(PoseCorrection) checks.
absl::StatusOr<std::vector<CorrectedPose>> DecodeCorrectedPoses(
    const google::protobuf::RepeatedPtrField<v1::CorrectedPose>& messages);

// Encodes a correction as bytes: exact, and equal for equal corrections.
std::string CorrectionToBytes(const PoseCorrection& correction);
// DATA_LOSS for bytes that are not a valid correction.
absl::StatusOr<PoseCorrection> CorrectionFromBytes(absl::string_view bytes);

// Encodes an object as bytes, exactly.
std::string ObjectToBytes(const SemanticObject& object);
absl::StatusOr<SemanticObject> ObjectFromBytes(absl::string_view bytes);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_OBSERVATION_H_
