// The answers of IngestService on the wire.
#ifndef HYPERMAP_WIRE_INGEST_H_
#define HYPERMAP_WIRE_INGEST_H_

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "map/observations/object_history.h"
#include "map/observations/observe_answers.h"

namespace hypermap::wire {

void EncodeVerdict(const ObservationVerdict& verdict, v1::ObservationAcknowledgement* message);
// INVALID_ARGUMENT for an outcome that is missing or unknown.
absl::StatusOr<ObservationVerdict> DecodeVerdict(const v1::ObservationAcknowledgement& message);

// Returns the verdict on an observation that can't be decoded, without a revision. `why` is the
// error of DecodeObservation.
ObservationVerdict InvalidVerdict(const v1::Observation& observation, const absl::Status& why);

void EncodeOpened(const OpenedLayer& opened, v1::ObserveOpened* message);
OpenedLayer DecodeOpened(const v1::ObserveOpened& message);

void EncodeObjectHistory(const ObjectHistory& history, v1::ExplainObjectResponse* message);
// INVALID_ARGUMENT for the kind of an event that is missing or unknown.
absl::StatusOr<ObjectHistory> DecodeObjectHistory(const v1::ExplainObjectResponse& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_INGEST_H_
