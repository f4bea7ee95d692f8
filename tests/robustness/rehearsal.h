// A run of a scenario without faults, from which those with faults are planned and judged.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_REHEARSAL_H_
#define HYPERMAP_TESTS_ROBUSTNESS_REHEARSAL_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "tests/robustness/judge.h"
#include "tests/robustness/recorder.h"
#include "tests/robustness/scenario.h"
#include "tests/robustness/supervisor.h"

namespace hypermap::robustness {

// A deliberate mistake, by which the harness is tested: it must be found.
enum class Plant {
  kNone,
  kFolderSyncIsLeftOut,
  kFileSyncIsLeftOut,
  kFailedSyncIsBelieved,
  kAcknowledgedTooEarly,
  kErrorIsIgnored,
  kDamageWithChecksum,  // of flipped bits: the page gets a valid checksum
};

// The steps that were told to be begun and done when something happened.
struct Progress {
  int begun = 0;
  int done = 0;
};

// A call that can fail.
struct RehearsedCall {
  FileCall call = FileCall::kOpen;
  int step = 0;
  std::string path;
};

struct Rehearsal {
  Scenario* scenario = nullptr;
  FileTree before;                   // the files before the first step
  FileTree after;                    // and after the last one
  std::vector<Description> states;   // states[i]: what is found after i steps
  std::vector<RehearsedCall> calls;  // in order
  std::unique_ptr<Recorder> record;  // its notes are indexes of `progress`
  std::vector<Progress> progress;
};

// Prepares and runs the scenario in processes of their own. An error if it fails. `known` are the
// states, if another rehearsal has found them.
absl::StatusOr<Rehearsal> Rehearse(Scenario* scenario, const std::string& folder, Plant plant,
                                   std::vector<Description> known = {});

// The body of a process that carries out all steps, trying each a few times.
void Live(const Rehearsal& rehearsal, const std::string& folder, Plant plant, const Teller& teller);

// How often a step is tried, and the error of a step after which the disk is mended.
inline constexpr int kTries = 4;
inline constexpr int kErrorsUntilMended = 2;

// Describes and judges the folder in a new process, which also makes the next change. `lost_power`:
// then a map may be another incarnation, because nothing syncs the name of a new witness.
Judgement JudgeFolder(const Rehearsal& rehearsal, const std::string& folder, const Progress& known,
                      bool lost_power);

// Describes the folder in a new process.
absl::StatusOr<Description> DescribeApart(Scenario& scenario, const std::string& folder);

// Runs a function in a new process, which may die or hang. INTERNAL if it does.
absl::StatusOr<std::string> RunApart(absl::FunctionRef<absl::StatusOr<std::string>()> function);

// Whether the call can fail: the release of a lock can't.
bool CanFail(const SeenCall& call);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_REHEARSAL_H_
