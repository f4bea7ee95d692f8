// Pieces of furniture made of prisms. They stand at the origin with their fronts towards -y.
#ifndef HYPERMAP_SIMULATION_WORLDS_FURNITURE_H_
#define HYPERMAP_SIMULATION_WORLDS_FURNITURE_H_

#include "map/frames/planar_transform.h"
#include "simulation/worlds/scene.h"

namespace hypermap::simulation {

Body DiningTable();  // 1.6 x 0.9 m.
Body Desk();         // 1.3 x 0.7 m. Its label is "diningtable", as detectors would have it.
Body Chair();
Body Couch();
Body Suitcase();
Body PottedPlant();
Body Cup();  // 8 cm wide.
Body Bottle();
Body Book();
Body Laptop();
Body Screen();  // A "tvmonitor" on its foot.

// Returns the body moved on the plane and lifted by `lift_m`.
Body Placed(const Body& body, const PlanarTransform& world_from_body, double lift_m);

// The top of a table: the area where things may stand, in the table's frame, and its height.
struct Top {
  Box area;
  double height_m = 0.0;
};
Top TopOf(const Body& table);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_FURNITURE_H_
