// The bodies of evidence that maps store: observations and the objects of operators' facts. They
// are in the encoding of the wire contract.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_STORED_EVIDENCE_H_
#define HYPERMAP_CLIENT_LIBS_CPP_STORED_EVIDENCE_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/objects/semantic_object.h"
#include "map/observations/observation.h"

namespace hypermap::client {

// DATA_LOSS for bytes that are not a body of that kind.
absl::StatusOr<Observation> DecodeStoredObservation(absl::string_view body);
absl::StatusOr<SemanticObject> DecodeStoredObject(absl::string_view body);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_STORED_EVIDENCE_H_
