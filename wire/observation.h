// Observations on the wire, and as the bytes that a log keeps.
#ifndef HYPERMAP_WIRE_OBSERVATION_H_
#define HYPERMAP_WIRE_OBSERVATION_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/observation.pb.h"
#include "map/observations/observation.h"
#include "wire/limits.h"

namespace hypermap::wire {

void EncodeObservation(const Observation& observation, v1::Observation* message);

// An observation of a request. Leaves what Validate(Observation) checks to it.
absl::StatusOr<Observation> DecodeObservation(absl::string_view field,
                                              const v1::Observation& message,
                                              const DecodeLimits& limits);

// As bytes: exact, and the same for equal observations.
std::string ObservationToBytes(const Observation& observation);
// The bytes that ObservationToBytes of version 0.1 made.
std::string ObservationToBytes01(const Observation& observation);
// DATA_LOSS for bytes that are none. Polygons are taken to be valid.
absl::StatusOr<Observation> ObservationFromBytes(absl::string_view bytes);

// An object as bytes, exact.
std::string ObjectToBytes(const SemanticObject& object);
absl::StatusOr<SemanticObject> ObjectFromBytes(absl::string_view bytes);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_OBSERVATION_H_
