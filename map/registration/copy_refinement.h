// Refines the pose of a grid that is a copy of another one, cell by cell.
#ifndef HYPERMAP_MAP_REGISTRATION_COPY_REFINEMENT_H_
#define HYPERMAP_MAP_REGISTRATION_COPY_REFINEMENT_H_

#include "absl/status/statusor.h"
#include "map/frames/planar_transform.h"
#include "map/registration/wall_map.h"

namespace hypermap::registration {

// Returns a better pose near `pose`, if one of the grids was made from the other by looking up each
// of its cells there (a map that was turned, cropped or exported with other cells): then, at the
// true pose, the centre of every occupied cell of the copy lies in an occupied cell of the
// original. Distances to walls leave an error of up to half a cell where walls are parallel to the
// axes of one of the grids, and this does not. Otherwise returns `pose`.
//
// Maximises the number of such cells by the cross-entropy method (Rubinstein 1999), because it is
// piecewise constant. Takes less than a tenth of a second. Errors of CheckCancelled.
absl::StatusOr<PlanarTransform> RefinedAsCopy(const WallMap& source, const WallMap& target,
                                              const PlanarTransform& pose);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_COPY_REFINEMENT_H_
