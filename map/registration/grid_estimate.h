// Estimates the transform between two occupancy grids.
#ifndef HYPERMAP_MAP_REGISTRATION_GRID_ESTIMATE_H_
#define HYPERMAP_MAP_REGISTRATION_GRID_ESTIMATE_H_

#include "absl/status/statusor.h"
#include "map/layers/grid_layer.h"
#include "map/registration/transform_estimate.h"

namespace hypermap::registration {

// Returns the transform from the frame of `source` to that of `target`, both occupancy layers, at
// which their walls agree best. Needs no first guess: any yaw and offset is found. The grids may
// have different resolutions, unknown cells, and parts that the other one lacks.
//
// FAILED_PRECONDITION if one of them has no occupied cell, RESOURCE_EXHAUSTED if one has more known
// cells than WallMap::kMaxCells, errors of CheckCancelled and TakeMemory.
absl::StatusOr<TransformEstimate> EstimateFromGrids(const GridLayer& source,
                                                    const GridLayer& target);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_GRID_ESTIMATE_H_
