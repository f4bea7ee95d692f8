// A laser that scans a plane just above the floor: what made the occupancy layer.
#ifndef HYPERMAP_SIMULATION_WORLDS_LASER_H_
#define HYPERMAP_SIMULATION_WORLDS_LASER_H_

#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "simulation/worlds/wall_grid.h"

namespace hypermap::simulation {

struct LaserFan {
  // Bearings to both sides of straight ahead; the whole fan is less than half a turn.
  double half_width_rad = 0.5;
  double range_m = 4.0;
};

// What lies free before the laser, in the world: from where it stands to the first wall in each
// bearing, or to the range. Two bearings are a third of a cell apart at the range, and a sixteenth
// of that where the range jumps. Measured without error, which is far less than a cell for a laser.
// Empty when it stands in a wall.
Polygon FreeBefore(const WallGrid& walls, const PlanarTransform& world_from_laser,
                   const LaserFan& fan);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_LASER_H_
