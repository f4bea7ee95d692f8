// Explorations in answers of ExplorationService. Positions are in the frame of the answer.
#ifndef HYPERMAP_WIRE_EXPLORATION_H_
#define HYPERMAP_WIRE_EXPLORATION_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/exploration_service.pb.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/exploration_view.h"

namespace hypermap::wire {

v1::ExplorationState EncodeExplorationState(ExplorationState state);
absl::StatusOr<ExplorationState> DecodeExplorationState(absl::string_view field,
                                                        v1::ExplorationState state);

// kNone becomes unspecified.
v1::EndReason EncodeEndReason(EndReason reason);
absl::StatusOr<EndReason> DecodeEndReason(absl::string_view field, v1::EndReason reason);

v1::GoalOutcome EncodeGoalOutcome(GoalOutcome outcome);
// INVALID_ARGUMENT for an outcome that is missing or unknown.
absl::StatusOr<GoalOutcome> DecodeGoalOutcome(absl::string_view field, v1::GoalOutcome outcome);

void EncodeGoal(const LeasedGoal& goal, v1::Goal* message);
absl::StatusOr<LeasedGoal> DecodeGoal(absl::string_view field, const v1::Goal& message);

void EncodeExploration(const ExplorationEntry& entry, v1::Exploration* message);
absl::StatusOr<ExplorationEntry> DecodeExploration(absl::string_view field,
                                                   const v1::Exploration& message);

void EncodeProgress(const ExplorationProgress& progress, v1::ExplorationProgress* message);
// Ignores the fraction, which follows from the numbers of cells.
ExplorationProgress DecodeProgress(const v1::ExplorationProgress& message);

void EncodeFrontier(const FrontierEntry& frontier, v1::Frontier* message);
absl::StatusOr<FrontierEntry> DecodeFrontier(absl::string_view field, const v1::Frontier& message);

// Leave the revision and the frame to the caller.
void EncodeClaimResult(const ClaimResult& result, v1::ClaimGoalResponse* message);
absl::StatusOr<ClaimResult> DecodeClaimResult(const v1::ClaimGoalResponse& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_EXPLORATION_H_
