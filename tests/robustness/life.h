// A process that goes through a scenario with a fault.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_LIFE_H_
#define HYPERMAP_TESTS_ROBUSTNESS_LIFE_H_

#include <string>
#include <vector>

#include "tests/robustness/faults.h"
#include "tests/robustness/judge.h"
#include "tests/robustness/recorder.h"
#include "tests/robustness/rehearsal.h"
#include "tests/robustness/supervisor.h"

namespace hypermap::robustness {

struct Life {
  Progress progress;
  Ending ending;
  bool has_ended = false;  // all steps are done
  std::string problem;     // of an answer of the process itself
};

// Runs the process to its end. `recorder` may be null; its notes are indexes of `notes`.
Life RunLife(const Rehearsal& rehearsal, const std::string& folder, Plant plant,
             FaultyCalls* faulty, Recorder* recorder, std::vector<Progress>* notes);

// Judges the process itself: that it did not die or hang, and told no error that does not pass.
Judgement JudgeLife(const Life& life);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_LIFE_H_
