// Answers of a server about observations and fused layers, as plain values.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_INGEST_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_INGEST_ANSWERS_H_

#include "map/observations/object_history.h"
#include "map/observations/observe_answers.h"

namespace hypermap::client {

using hypermap::ObservationOutcome;
using hypermap::ObservationOutcomeName;
using hypermap::OpenedLayer;
using hypermap::SequenceRange;
// The server's verdict on an observation.
using Acknowledgement = hypermap::ObservationVerdict;

using hypermap::ObjectEvent;
using hypermap::ObjectEventKind;
using hypermap::ObjectEventKindName;
using hypermap::ObjectHistory;

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_INGEST_ANSWERS_H_
