#include "client_libs/cpp/stored_evidence.h"

#include "wire/observation.h"

namespace hypermap::client {

absl::StatusOr<Observation> DecodeStoredObservation(absl::string_view body) {
  return wire::ObservationFromBytes(body);
}

absl::StatusOr<SemanticObject> DecodeStoredObject(absl::string_view body) {
  return wire::ObjectFromBytes(body);
}

}  // namespace hypermap::client
