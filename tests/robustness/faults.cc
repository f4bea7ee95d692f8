#include "tests/robustness/faults.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <random>
#include <tuple>

#include "tests/support/random_map.h"

namespace hypermap::robustness {
namespace {

constexpr std::array<const char*, kNumFaults> kFaultNames = {
    "a call fails",     "calls fail",           "short write", "disk full",
    "disk read-only",   "no descriptors",       "kill",        "power loss",
    "loss, sync fails", "loss during recovery", "bit flip",    "bit flip, killed"};

}  // namespace

std::string NameOf(Fault fault) { return kFaultNames[static_cast<size_t>(fault)]; }

std::vector<FailingCall> FailingCalls(const Rehearsal& rehearsal, Fault fault, uint64_t seed,
                                      bool every) {
  constexpr int kMostAlike = 6;
  std::vector<FailingCall> all;
  for (size_t i = 0; i < rehearsal.calls.size(); ++i) {
    // SQLite tries for ten seconds to get a lock of a log.
    if (fault == Fault::kCallsFail && rehearsal.calls[i].call == FileCall::kLock) continue;
    for (size_t error = 0; error < ErrorsOf(rehearsal.calls[i].call).size(); ++error) {
      all.push_back({static_cast<int>(i), error});
    }
  }
  testing::Rng rng(seed);
  std::shuffle(all.begin(), all.end(), rng);
  std::vector<FailingCall> calls;
  std::map<std::tuple<int, FileCall, std::string, size_t>, int> alike;
  for (const FailingCall& failing : all) {
    const RehearsedCall& call = rehearsal.calls[failing.at];
    int& count = alike[{call.step, call.call, call.path, failing.error}];
    if (++count <= kMostAlike || every) calls.push_back(failing);
  }
  return calls;
}

std::vector<int> CallsOf(const Rehearsal& rehearsal, FileCall call) {
  std::vector<int> calls;
  for (size_t i = 0; i < rehearsal.calls.size(); ++i) {
    if (rehearsal.calls[i].call == call) calls.push_back(static_cast<int>(i));
  }
  return calls;
}

Answer FaultyCalls::Next(const SeenCall& call) {
  if (!CanFail(call)) return {};
  const int number = number_++;
  if (number == failing_.at) kind_ = call.call;
  if (mended_ || number < failing_.at) return {};
  if (fault_ == Fault::kShortWrite && call.call == FileCall::kWrite) return HalfWrite();
  return Decide(call, number);
}

Answer FaultyCalls::Decide(const SeenCall& call, int number) const {
  switch (fault_) {
    case Fault::kCallFails:
    case Fault::kPowerLossAfterFailedSync:
      return number == failing_.at ? Failure(call, ErrorOf(call)) : Answer{};
    case Fault::kCallsFail:
      return call.call == kind_ ? Failure(call, ErrorOf(call)) : Answer{};
    case Fault::kDiskFull:
      return TakesSpace(call.call, call.for_writing) ? Failure(call, ENOSPC) : Answer{};
    case Fault::kDiskReadOnly:
      return ChangesDisk(call.call, call.for_writing) ? Failure(call, EROFS) : Answer{};
    case Fault::kNoDescriptors:
      return call.call == FileCall::kOpen ? Failure(call, EMFILE) : Answer{};
    case Fault::kKill:
    case Fault::kBitFlipAfterKill:
      return {Answer::Kind::kKill};
    default:
      return {};
  }
}

Answer FaultyCalls::HalfWrite() {
  const bool is_first = !wrote_half_;
  wrote_half_ = true;
  if (is_first) return {Answer::Kind::kHalf};
  return {Answer::Kind::kFail, ENOSPC};
}

int FaultyCalls::ErrorOf(const SeenCall& call) const {
  const std::vector<int> errors = ErrorsOf(call.call);
  return errors[failing_.error % errors.size()];
}

Answer FaultyCalls::Failure(const SeenCall& call, int error) const {
  const bool is_believed = plant_ == Plant::kFailedSyncIsBelieved && call.call == FileCall::kSync;
  return {is_believed ? Answer::Kind::kPretend : Answer::Kind::kFail, error};
}

}  // namespace hypermap::robustness
