// Runs of a scenario with a fault, and what becomes of them.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_TRIALS_H_
#define HYPERMAP_TESTS_ROBUSTNESS_TRIALS_H_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/robustness/faults.h"
#include "tests/robustness/rehearsal.h"

namespace hypermap::robustness {

struct Counts {
  int64_t runs = 0;
  int64_t lost = 0;
  int64_t half_done = 0;
  int64_t wrong = 0;
  int64_t wedged = 0;
  // How the runs ended that were hurt by nothing of that.
  int64_t by_itself = 0;   // the process went on
  int64_t by_restart = 0;  // a new process found everything whole
  int64_t named = 0;       // the damage was named, so that a backup can take its place

  void Add(const Counts& other);
  int64_t failures() const { return lost + half_done + wrong + wedged; }
};

struct TrialReport {
  Counts counts;
  // Each begins with the scenario, the fault and the number of the trial.
  std::vector<std::string> problems;
};

// Trials first, first + 1, ... of a fault, which are the same each time.
struct Trials {
  Fault fault = Fault::kCallFails;
  int64_t first = 0;
  int64_t count = 1;
  bool every = false;  // kCallFails: every call, and not only some of those that are alike
};

// The number of different trials of a fault that depends on a call, or 0 if any number is possible.
int64_t NumDifferent(const Rehearsal& rehearsal, Fault fault, bool every);

// `folder` is for the files of the runs.
TrialReport RunTrials(const Rehearsal& rehearsal, const Trials& trials, uint64_t seed, Plant plant,
                      const std::string& folder);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_TRIALS_H_
