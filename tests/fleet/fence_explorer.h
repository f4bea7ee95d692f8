// Visits all states of the model that can be reached, breadth first.
#ifndef HYPERMAP_TESTS_FLEET_FENCE_EXPLORER_H_
#define HYPERMAP_TESTS_FLEET_FENCE_EXPLORER_H_

#include <cstddef>
#include <string>
#include <vector>

#include "tests/fleet/fence_model.h"

namespace hypermap::fence_model {

struct Exploration {
  size_t states = 0;
  size_t steps = 0;
  size_t depth = 0;  // of the state that is farthest from the first
  // The invariant that does not hold; empty if all hold.
  std::string violation;
  // The shortest history to a state in which it does not hold.
  std::vector<std::string> trace;
};

// Checks the invariants in all states. If they hold, checks progress: from each state in which a
// process runs, a state can be reached without further faults in which an owner can write.
Exploration Explore(const Rules& rules);

}  // namespace hypermap::fence_model

#endif  // HYPERMAP_TESTS_FLEET_FENCE_EXPLORER_H_
