// How evidence is kept: as it comes over the wire.
#ifndef HYPERMAP_SERVER_SERVICES_EVIDENCE_CODEC_H_
#define HYPERMAP_SERVER_SERVICES_EVIDENCE_CODEC_H_

#include "server/fusion/fusion_options.h"
#include "wire/observation.h"

namespace hypermap::server {

inline EvidenceCodec WireEvidenceCodec() {
  return {&wire::ObservationToBytes, &wire::ObservationFromBytes, &wire::ObjectToBytes,
          &wire::ObjectFromBytes, &wire::ObservationToBytes01};
}

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EVIDENCE_CODEC_H_
