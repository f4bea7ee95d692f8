// The requests of ExplorationService on the wire.
//
// Encode... leaves the map to the caller, and the author is not part of a message. Decode... names
// the field that is wrong.
#ifndef HYPERMAP_WIRE_EXPLORATION_REQUESTS_H_
#define HYPERMAP_WIRE_EXPLORATION_REQUESTS_H_

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "hypermap/v1/exploration_service.pb.h"
#include "map/exploration/exploration_requests.h"

namespace hypermap::wire {

void EncodeStart(const ExplorationStart& start, v1::StartExplorationRequest* message);
// A range or a minimal gain of 0 is replaced by the default. RESOURCE_EXHAUSTED for an area
// that exceeds limits.max_question_vertices.
absl::StatusOr<ExplorationStart> DecodeStart(const v1::StartExplorationRequest& message,
                                             const Limits& limits);

void EncodeClaim(const GoalClaim& claim, v1::ClaimGoalRequest* message);
absl::StatusOr<GoalClaim> DecodeClaim(const v1::ClaimGoalRequest& message);

void EncodeRenewal(const GoalRenewal& renewal, v1::RenewGoalRequest* message);
absl::StatusOr<GoalRenewal> DecodeRenewal(const v1::RenewGoalRequest& message);

void EncodeRelease(const GoalRelease& release, v1::ReleaseGoalRequest* message);
absl::StatusOr<GoalRelease> DecodeRelease(const v1::ReleaseGoalRequest& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_EXPLORATION_REQUESTS_H_
