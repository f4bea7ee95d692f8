// Explorations on the wire.
//
// Stored explorations are in the frame of their layer, and messages are in the frame of the
// request: `frame_from_layer` converts. Goals, places, progress and frontiers occur only in
// answers, and clients read their fields directly; hence these have no Decode function.
#ifndef HYPERMAP_WIRE_EXPLORATION_H_
#define HYPERMAP_WIRE_EXPLORATION_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/exploration_service.pb.h"
#include "map/exploration/exploration_objects.h"
#include "map/exploration/explorer.h"
#include "map/frames/planar_transform.h"
#include "map/grid/grid_geometry.h"

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

void EncodeGoal(const ExplorationGoal& goal, const PlanarTransform& frame_from_layer,
                v1::Goal* message);
void EncodeUnreachablePlace(const UnreachablePlace& place, const PlanarTransform& frame_from_layer,
                            v1::UnreachablePlace* message);

// Includes its goals and places.
void EncodeExploration(const ExplorationObjects& objects, const PlanarTransform& frame_from_layer,
                       v1::Exploration* message);
// Decodes an exploration of an answer, without its goals and places. The area is in the frame of
// the answer.
absl::StatusOr<Exploration> DecodeExploration(absl::string_view field,
                                              const v1::Exploration& message);

void EncodeProgress(const Explorer::Progress& cells, double cell_area_m2, double rate_m2_per_s,
                    v1::ExplorationProgress* message);

// `geometry` is that of the occupancy layer; here `frame_from_layer` starts from that layer's
// frame.
void EncodeFrontier(const Explorer::FrontierView& frontier, const GridGeometry& geometry,
                    const PlanarTransform& frame_from_layer, bool with_cells,
                    v1::Frontier* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_EXPLORATION_H_
