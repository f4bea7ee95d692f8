// Scenarios: what a process does with the files of a folder, as steps whose results are known.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_SCENARIO_H_
#define HYPERMAP_TESTS_ROBUSTNESS_SCENARIO_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace hypermap::robustness {

// All that a client can ask of the files, as text by parts: a map's newest revision, each past one,
// receipts, the queue of an outbox, and so on. Two descriptions are equal if all answers are.
using Description = std::map<std::string, std::string>;

// A process that carries out the steps of a scenario. It opens the files at the first step that
// needs them.
class Actor {
 public:
  virtual ~Actor() = default;

  // Carries out a step, which is begun again after an error.
  virtual absl::Status Do(int step) = 0;

  // What this process answers now: some of the parts of Scenario::Describe.
  virtual absl::StatusOr<Description> Describe() = 0;
};

// The same seed makes the same scenario. Its functions are called in processes of their own, which
// end afterwards.
class Scenario {
 public:
  virtual ~Scenario() = default;

  virtual std::string name() const = 0;
  // Makes the files as they are before the first step.
  virtual absl::Status Prepare(const std::string& folder) = 0;
  virtual int num_steps() const = 0;
  virtual std::unique_ptr<Actor> Start(const std::string& folder) = 0;

  // Opens everything, as a process does that is started again, and describes it.
  virtual absl::StatusOr<Description> Describe(const std::string& folder) = 0;
  // Changes what is there once more, and checks that the change is kept.
  virtual absl::Status GoOn(const std::string& folder) = 0;
};

// All scenarios.
std::vector<std::unique_ptr<Scenario>> MakeScenarios(uint64_t seed);

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_SCENARIO_H_
