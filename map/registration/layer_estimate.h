// Estimates the transform between two layers of the same kind, of one map or of two.
#ifndef HYPERMAP_MAP_REGISTRATION_LAYER_ESTIMATE_H_
#define HYPERMAP_MAP_REGISTRATION_LAYER_ESTIMATE_H_

#include <string>

#include "absl/status/statusor.h"
#include "map/registration/transform_estimate.h"
#include "map/snapshot.h"

namespace hypermap::registration {

// A layer of a map, and the frame of which the transform is wanted.
struct PlacedLayer {
  SnapshotPtr snapshot;
  std::string layer;
  std::string frame_id;  // empty: the map's own
};

// Returns the transform from the frame of `source` to that of `target` at which the layers agree
// best: both occupancy (EstimateFromGrids), or both semantic (EstimateFromObjects).
//
// NOT_FOUND for an unknown layer or frame, DATA_LOSS for a layer that is damaged,
// FAILED_PRECONDITION for layers of other kinds, or one whose frame is not connected to the wanted
// one. Other errors are those of the two functions.
absl::StatusOr<TransformEstimate> EstimateFromLayers(const PlacedLayer& source,
                                                     const PlacedLayer& target);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_LAYER_ESTIMATE_H_
