// How high things of a class are, for maps that do not say it of the things themselves.
#ifndef HYPERMAP_SIMULATION_WORLDS_CLASS_HEIGHTS_H_
#define HYPERMAP_SIMULATION_WORLDS_CLASS_HEIGHTS_H_

#include "absl/strings/string_view.h"

namespace hypermap::simulation {

struct ClassHeight {
  // From its lower end to its upper end, metres.
  double height_m = 1.0;
  // Of its lower end above what it stands on: more than 0 for what hangs on walls.
  double above_m = 0.0;
  // Whether other things may stand on it.
  bool carries = false;
};

// Of a class by its name, whatever its case, blanks, '_' and '-': the table in the .cc. What is not
// there is 1 m high and stands on the floor.
ClassHeight HeightOfClass(absl::string_view label);

}  // namespace hypermap::simulation

#endif  // HYPERMAP_SIMULATION_WORLDS_CLASS_HEIGHTS_H_
