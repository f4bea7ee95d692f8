// A laser that scans the plane of the occupancy layer, just above the floor.
#ifndef HYPERMAP_SIMULATION_WORLDS_LASER_H_
#define HYPERMAP_SIMULATION_WORLDS_LASER_H_

#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "simulation/worlds/wall_grid.h"

namespace hypermap::simulation {

struct LaserFan {
  // Half of the angle of the fan, which is symmetric to straight ahead. Less than pi / 2.
  double half_width_rad = 0.5;
  double range_m = 4.0;
};

// Returns the free area that the laser sees, in the world: from its position to the first wall on
// each bearing, or to its range. Neighbouring bearings are a third of a cell apart at full range,
// and a sixteenth of that where the measured range jumps. Ranges have no error, since that of a
// laser is far smaller than a cell. Empty if the laser is not on free floor.
Polygon FreeBefore(const WallGrid& walls, const PlanarTransform& world_from_laser,
                   const LaserFan& fan);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_LASER_H_
