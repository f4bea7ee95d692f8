// Faults, and the calls that they make fail.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_FAULTS_H_
#define HYPERMAP_TESTS_ROBUSTNESS_FAULTS_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/robustness/file_calls.h"
#include "tests/robustness/rehearsal.h"
#include "tests/robustness/supervisor.h"

namespace hypermap::robustness {

enum class Fault {
  kCallFails,     // one call, once
  kCallsFail,     // all calls of a kind, until the disk is mended
  kShortWrite,    // half of a write is done, and the disk is full then, until it is mended
  kDiskFull,      // until it is mended
  kDiskReadOnly,  // until it is mended
  kNoDescriptors,
  kKill,
  kPowerLoss,
  kPowerLossAfterFailedSync,
  kPowerLossInRecovery,  // after another one
  kBitFlip,              // in a file that is closed
  kBitFlipAfterKill,     // in a file that nobody has closed
};
inline constexpr int kNumFaults = 12;

std::string NameOf(Fault fault);

// A call that fails, and the choice of its error.
struct FailingCall {
  int at = 0;
  size_t error = 0;
};

// Each call with each of its errors, in random order. Of many calls of one kind for one file in one
// step, such as the reads of all pages, some, unless `every`.
std::vector<FailingCall> FailingCalls(const Rehearsal& rehearsal, Fault fault, uint64_t seed,
                                      bool every);
// The numbers of the calls of a kind.
std::vector<int> CallsOf(const Rehearsal& rehearsal, FileCall call);

// Decides which calls of a run fail.
class FaultyCalls {
 public:
  FaultyCalls(Fault fault, FailingCall failing, Plant plant)
      : fault_(fault), failing_(failing), plant_(plant) {}

  // From now on no call fails.
  void Mend() { mended_ = true; }

  // The answer to the next call.
  Answer Next(const SeenCall& call);

 private:
  Answer Decide(const SeenCall& call, int number) const;
  Answer HalfWrite();
  Answer Failure(const SeenCall& call, int error) const;
  int ErrorOf(const SeenCall& call) const;

  const Fault fault_;
  const FailingCall failing_;
  const Plant plant_;
  int number_ = 0;
  FileCall kind_ = FileCall::kOpen;  // of the call that failed first
  bool mended_ = false;
  bool wrote_half_ = false;
};

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_FAULTS_H_
