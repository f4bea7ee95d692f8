// A furnished place made of upright prisms. Metres; z points up, the floor is z = 0.
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

// A convex footprint, counter-clockwise, drawn up from `low_m` to `high_m`.
struct Prism {
  Ring footprint;
  double low_m = 0.0;
  double high_m = 0.0;

  friend bool operator==(const Prism&, const Prism&) = default;
};

// A thing to be found.
struct Body {
  std::string label;
  std::vector<Prism> parts;
};

struct Scene {
  Box bounds;                    // of the floor
  std::vector<Prism> structure;  // floor and walls
  std::vector<Body> bodies;
  Ring path;  // what the robot drives along; nothing stands on it
  std::optional<WallGrid> walls;
};

// Convex hull of the parts on the plane, and their heights.
Polygon FootprintOf(const Body& body);
HeightRange HeightOf(const Body& body);

// Two rooms joined by a door, with tables, chairs, couches, screens, bags and plants on the floor,
// and cups, bottles, books and laptops on the tables. The same seed gives the same place.
Scene MakeOffice(uint64_t seed);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_SCENE_H_
