// Judges what is found after a fault.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_JUDGE_H_
#define HYPERMAP_TESTS_ROBUSTNESS_JUDGE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "tests/robustness/scenario.h"

namespace hypermap::robustness {

enum class Outcome {
  kWhole,
  kLost,      // what was acknowledged is missing
  kHalfDone,  // some answers are from before a step, others from after it
  kWrong,     // an answer that no state gives, or an error that tells something untrue
  kWedged,    // it can't be opened, or takes no further change
};

std::string NameOf(Outcome outcome);

struct Judgement {
  Outcome outcome = Outcome::kWhole;
  std::string reason;  // empty for kWhole
};

// Judges a description where steps up to `acknowledged` (counted; 0: none) are done, and those up
// to `begun` may be. states[i] is what is found after i steps. `with_notes`: a map that is another
// incarnation than it was is wrong.
Judgement Judge(absl::StatusOr<Description> found, const std::vector<Description>& states,
                int acknowledged, int begun, bool with_notes);

// Judges some parts, which must be as they are after `done` steps.
Judgement JudgeParts(const absl::StatusOr<Description>& found, const Description& state);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_JUDGE_H_
