// Finds the poses at which two occupancy grids may lie over each other.
#ifndef HYPERMAP_MAP_REGISTRATION_POSE_SEARCH_H_
#define HYPERMAP_MAP_REGISTRATION_POSE_SEARCH_H_

#include <vector>

#include "absl/status/statusor.h"
#include "map/registration/transform_estimate.h"
#include "map/registration/wall_map.h"

namespace hypermap::registration {

// Returns up to `most` poses, best first, that are some cells of the search apart from each other,
// whatever the yaw and the offset. Searches all yaws in steps at which walls move by about a cell
// and, for each of them, all offsets by a Fourier transform. The cells are as small as images of
// 512 x 512 permit: 0.1 m for grids of 15 m, 0.25 m for 50 m.
//
// The score of a pose counts walls near walls less walls on free cells, both of the source on the
// target and of the target on the source, as a share of what it is where everything agrees.
//
// Some seconds of one core for grids of 50 m. Errors of CheckCancelled.
absl::StatusOr<std::vector<Mode>> SearchPoses(const WallMap& source, const WallMap& target,
                                              int most);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_POSE_SEARCH_H_
