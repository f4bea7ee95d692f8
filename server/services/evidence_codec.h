// The encoding of stored evidence.
#ifndef HYPERMAP_SERVER_SERVICES_EVIDENCE_CODEC_H_
#define HYPERMAP_SERVER_SERVICES_EVIDENCE_CODEC_H_

#include "server/fusion/fusion_options.h"
#include "wire/observation.h"

namespace hypermap::server {

// Evidence is stored in the encoding of the wire contract, whose compatibility is checked.
inline EvidenceCodec WireEvidenceCodec() {
  return {&wire::ObservationToBytes,  &wire::ObservationFromBytes, &wire::ObjectToBytes,
          &wire::ObjectFromBytes,     &wire::CorrectionToBytes,    &wire::CorrectionFromBytes,
          &wire::ObservationToBytes01};
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EVIDENCE_CODEC_H_
