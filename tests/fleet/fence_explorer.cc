#include "tests/fleet/fence_explorer.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string_view>
#include <type_traits>
#include <utility>

namespace hypermap::fence_model {
namespace {

using StateIndex = uint32_t;
constexpr StateIndex kNone = UINT32_MAX;

size_t HashOf(const State& state) {
  static_assert(std::has_unique_object_representations_v<State>);
  return std::hash<std::string_view>()(
      std::string_view(reinterpret_cast<const char*>(&state), sizeof(state)));
}

// The visited states in the order of their discovery.
class StateSet {
 public:
  // The index of a state, and whether it is a new one.
  std::pair<StateIndex, bool> Add(const State& state) {
    if (states_.size() * 2 >= slots_.size()) Grow();
    StateIndex* const slot = FindSlot(state);
    if (*slot != kNone) return {*slot, false};
    *slot = static_cast<StateIndex>(states_.size());
    states_.push_back(state);
    return {*slot, true};
  }
  const State& operator[](StateIndex index) const { return states_[index]; }
  size_t size() const { return states_.size(); }

 private:
  StateIndex* FindSlot(const State& state) {
    size_t at = HashOf(state) & (slots_.size() - 1);
    while (slots_[at] != kNone && !(states_[slots_[at]] == state)) at = (at + 1) % slots_.size();
    return &slots_[at];
  }
  void Grow() {
    slots_.assign(slots_.size() * 2, kNone);
    for (StateIndex i = 0; i < states_.size(); ++i) *FindSlot(states_[i]) = i;
  }

  std::vector<State> states_;
  // Open addressing; the size is a power of two.
  std::vector<StateIndex> slots_ = std::vector<StateIndex>(1024, kNone);
};

class Explorer {
 public:
  explicit Explorer(const Rules& rules) : rules_(rules) {}

  Exploration Run() {
    Visit(InitialState(rules_), kNone);
    for (StateIndex i = 0; i < states_.size() && found_.violation.empty(); ++i) Expand(i);
    if (found_.violation.empty()) CheckProgress();
    found_.states = states_.size();
    return found_;
  }

 private:
  StateIndex Visit(const State& state, StateIndex parent) {
    const auto [index, is_new] = states_.Add(state);
    if (!is_new) return index;
    parents_.push_back(parent);
    depths_.push_back(parent == kNone ? 0 : depths_[parent] + 1);
    found_.depth = depths_.back();
    if (const char* const violation = FindViolation(state)) Report(violation, index);
    return index;
  }

  void Expand(StateIndex index) {
    steps_.clear();
    const State state = states_[index];
    AddSteps(rules_, state, &steps_);
    found_.steps += steps_.size();
    for (const Step& step : steps_) {
      const StateIndex next = Visit(step.next, index);
      if (!found_.violation.empty()) return;
      if (!IsFault(step.action.kind)) edges_.emplace_back(next, index);
    }
  }

  // Goes backward from the states in which an owner can write.
  void CheckProgress() {
    std::sort(edges_.begin(), edges_.end());
    std::vector<bool> leads(states_.size(), false);
    std::vector<StateIndex> open;
    for (StateIndex i = 0; i < states_.size(); ++i) {
      if (!CanWrite(states_[i])) continue;
      leads[i] = true;
      open.push_back(i);
    }
    while (!open.empty()) {
      const StateIndex to = open.back();
      open.pop_back();
      auto edge = std::lower_bound(edges_.begin(), edges_.end(), std::pair(to, StateIndex{0}));
      for (; edge != edges_.end() && edge->first == to; ++edge) {
        if (leads[edge->second]) continue;
        leads[edge->second] = true;
        open.push_back(edge->second);
      }
    }
    ReportStuck(leads);
  }

  void ReportStuck(const std::vector<bool>& leads) {
    for (StateIndex i = 0; i < states_.size(); ++i) {
      if (leads[i] || !HasRunningProcess(rules_, states_[i])) continue;
      return Report("some server can become the owner and write", i);
    }
  }

  void Report(const char* violation, StateIndex index) {
    found_.violation = violation;
    for (; parents_[index] != kNone; index = parents_[index]) {
      found_.trace.push_back(DescribeStepTo(index));
    }
    std::reverse(found_.trace.begin(), found_.trace.end());
  }

  std::string DescribeStepTo(StateIndex index) const {
    std::vector<Step> steps;
    const State& before = states_[parents_[index]];
    AddSteps(rules_, before, &steps);
    const auto step = std::find_if(steps.begin(), steps.end(), [&](const Step& candidate) {
      return candidate.next == states_[index];
    });
    return Describe(before, *step);
  }

  const Rules rules_;
  StateSet states_;
  std::vector<StateIndex> parents_;
  std::vector<uint32_t> depths_;
  std::vector<std::pair<StateIndex, StateIndex>> edges_;  // to, from; without faults
  std::vector<Step> steps_;
  Exploration found_;
};

}  // namespace

Exploration Explore(const Rules& rules) { return Explorer(rules).Run(); }

}  // namespace hypermap::fence_model
