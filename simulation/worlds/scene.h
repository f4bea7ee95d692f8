// Furnished rooms made of upright prisms. Coordinates are in metres; z points up, and the floor is
// at z = 0.
#ifndef HYPERMAP_SIMULATION_WORLDS_SCENE_H_
#define HYPERMAP_SIMULATION_WORLDS_SCENE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "map/geometry/polygon.h"
#include "map/objects/semantic_object.h"
#include "simulation/worlds/wall_grid.h"

namespace hypermap::simulation {

// A convex footprint, counter-clockwise, extruded from `low_m` to `high_m`.
struct Prism {
  Ring footprint;
  double low_m = 0.0;
  double high_m = 0.0;

  friend bool operator==(const Prism&, const Prism&) = default;
};

// An object that detectors may find.
struct Body {
  std::string label;
  std::vector<Prism> parts;
};

struct Scene {
  Box bounds;                    // Bounding box of the floor.
  std::vector<Prism> structure;  // Floor and walls that are prisms.
  std::vector<Body> bodies;
  Ring path;  // The robot's path, an open line that is free of furniture.
  std::optional<WallGrid> walls;
};

// Return the convex hull of the body's parts on the plane, and the range of their heights.
Polygon FootprintOf(const Body& body);
HeightRange HeightOf(const Body& body);

// Returns two rooms joined by a door, with tables, chairs, couches, suitcases and plants on the
// floor, and screens, laptops, cups, bottles and books on the tables. The same seed gives the same
// scene.
Scene MakeOffice(uint64_t seed);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_SCENE_H_
