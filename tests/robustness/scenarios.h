// The scenarios by the rooms that they exercise.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_SCENARIOS_H_
#define HYPERMAP_TESTS_ROBUSTNESS_SCENARIOS_H_

#include <memory>
#include <vector>

#include "tests/robustness/scenario.h"
#include "tests/support/random_map.h"

namespace hypermap::robustness {

using ScenarioPtr = std::unique_ptr<Scenario>;

// Of one stored map: its creation, edits, compaction, checkpoints, migration.
std::vector<ScenarioPtr> MapScenarios(testing::Rng& rng);
// Of a store: deletion, backup, restoration.
std::vector<ScenarioPtr> StoreScenarios(testing::Rng& rng);
// Of the open maps of a server: imports, fusion.
std::vector<ScenarioPtr> SessionScenarios(testing::Rng& rng);
// Of robots: outbox, replica.
std::vector<ScenarioPtr> RobotScenarios(testing::Rng& rng);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_SCENARIOS_H_
