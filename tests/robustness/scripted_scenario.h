// A scenario whose steps are functions of the objects that a process has open.
#ifndef HYPERMAP_TESTS_ROBUSTNESS_SCRIPTED_SCENARIO_H_
#define HYPERMAP_TESTS_ROBUSTNESS_SCRIPTED_SCENARIO_H_

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/robustness/scenario.h"

namespace hypermap::robustness {

// `Stage` has what a process has open. It is made from the path of the folder, without opening
// anything, and closes all in the order that its members demand.
template <typename Stage>
struct Script {
  std::string name;
  std::function<absl::Status(const std::string& folder)> prepare;
  std::vector<std::function<absl::Status(Stage&)>> steps;
  // What the open objects answer.
  std::function<absl::StatusOr<Description>(Stage&)> answers;
  std::function<absl::StatusOr<Description>(const std::string& folder)> describe;
  std::function<absl::Status(const std::string& folder)> go_on;
};

template <typename Stage>
class ScriptedScenario : public Scenario {
 public:
  explicit ScriptedScenario(Script<Stage> script) : script_(std::move(script)) {}

  std::string name() const override { return script_.name; }
  absl::Status Prepare(const std::string& folder) override { return script_.prepare(folder); }
  int num_steps() const override { return static_cast<int>(script_.steps.size()); }
  std::unique_ptr<Actor> Start(const std::string& folder) override {
    return std::make_unique<Player>(script_, folder);
  }
  absl::StatusOr<Description> Describe(const std::string& folder) override {
    return script_.describe(folder);
  }
  absl::Status GoOn(const std::string& folder) override { return script_.go_on(folder); }

 private:
  class Player : public Actor {
   public:
    Player(const Script<Stage>& script, const std::string& folder)
        : script_(script), stage_(folder) {}
    absl::Status Do(int step) override { return script_.steps[step - 1](stage_); }
    absl::StatusOr<Description> Describe() override { return script_.answers(stage_); }

   private:
    const Script<Stage>& script_;
    Stage stage_;
  };

  const Script<Stage> script_;
};

}  // namespace hypermap::robustness

#endif  // HYPERMAP_TESTS_ROBUSTNESS_SCRIPTED_SCENARIO_H_
