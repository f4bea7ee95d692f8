// Typical heights of the objects of a class, for maps whose objects have no heights.
#ifndef HYPERMAP_SIMULATION_WORLDS_CLASS_HEIGHTS_H_
#define HYPERMAP_SIMULATION_WORLDS_CLASS_HEIGHTS_H_

#include "absl/strings/string_view.h"

namespace hypermap::simulation {

struct ClassHeight {
  // Distance from the lower end to the upper end, metres.
  double height_m = 1.0;
  // Height of the lower end above the floor, metres: more than 0 for objects on walls.
  double above_m = 0.0;
  // True if other objects may stand on it.
  bool carries = false;
};

// Returns the height of a class by its name, from the table in the source file. Case, blanks, '_'
// and '-' are ignored. Objects of an unknown class are 1 m high and stand on the floor.
ClassHeight HeightOfClass(absl::string_view label);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_CLASS_HEIGHTS_H_
