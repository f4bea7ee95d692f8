// Explorations on the wire.
//
// What is kept of an exploration lies in the frame of its layer, messages in the frame that was
// asked for: `frame_from_layer` leads there. Goals, places, progress and frontiers are answers
// only; a client reads their fields as they are.
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

// kNone is unspecified.
v1::EndReason EncodeEndReason(EndReason reason);
absl::StatusOr<EndReason> DecodeEndReason(absl::string_view field, v1::EndReason reason);

v1::GoalOutcome EncodeGoalOutcome(GoalOutcome outcome);
// INVALID_ARGUMENT when it is missing or not known.
absl::StatusOr<GoalOutcome> DecodeGoalOutcome(absl::string_view field, v1::GoalOutcome outcome);

void EncodeGoal(const ExplorationGoal& goal, const PlanarTransform& frame_from_layer,
                v1::Goal* message);
void EncodeUnreachablePlace(const UnreachablePlace& place, const PlanarTransform& frame_from_layer,
                            v1::UnreachablePlace* message);

// With its goals and places.
void EncodeExploration(const ExplorationObjects& objects, const PlanarTransform& frame_from_layer,
                       v1::Exploration* message);
// Of an answer, without its goals and places: the area in the frame of the answer.
absl::StatusOr<Exploration> DecodeExploration(absl::string_view field,
                                              const v1::Exploration& message);

void EncodeProgress(const Explorer::Progress& cells, double cell_area_m2, double rate_m2_per_s,
                    v1::ExplorationProgress* message);

// `geometry` is of the occupancy layer, whose frame `frame_from_layer` starts from here.
void EncodeFrontier(const Explorer::FrontierView& frontier, const GridGeometry& geometry,
                    const PlanarTransform& frame_from_layer, bool with_cells,
                    v1::Frontier* message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_EXPLORATION_H_
