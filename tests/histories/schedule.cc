#include "tests/histories/schedule.h"

#include <algorithm>
#include <iostream>
#include <optional>
#include <utility>

namespace hypermap::histories {
namespace {

const absl::Time kBegin = absl::FromUnixSeconds(1'700'000'000);

class SimulatedLoop : public Executor::Running {
 public:
  SimulatedLoop(Schedule* schedule, Executor::Step step)
      : schedule_(schedule), state_(std::make_shared<State>()) {
    state_->step = std::move(step);
  }
  ~SimulatedLoop() override { SimulatedLoop::Join(); }

  void Wake() override {
    if (std::exchange(state_->is_due, true)) return;
    RunAfter(schedule_, state_, absl::ZeroDuration());
  }
  // Runs the steps that are left on the caller's stack: nothing else happens meanwhile.
  void Join() override {
    while (!state_->ended) RunStep(*state_);
  }

 private:
  struct State {
    Executor::Step step;
    bool is_due = false;
    bool ended = false;
    int64_t num_planned = 0;  // the newest plan counts
  };

  static std::optional<absl::Duration> RunStep(State& state) {
    state.is_due = false;
    const std::optional<absl::Duration> sleep = state.step();
    state.ended = !sleep;
    return sleep;
  }

  static void RunAfter(Schedule* schedule, const std::shared_ptr<State>& state,
                       absl::Duration delay) {
    const int64_t plan = ++state->num_planned;
    schedule->After(delay, [schedule, weak = std::weak_ptr<State>(state), plan] {
      const std::shared_ptr<State> state = weak.lock();
      if (!state || state->ended || state->num_planned != plan) return;
      const std::optional<absl::Duration> sleep = RunStep(*state);
      if (sleep && !state->is_due) RunAfter(schedule, state, *sleep);
    });
  }

  Schedule* const schedule_;
  const std::shared_ptr<State> state_;
};

}  // namespace

Schedule::Schedule(uint64_t seed, bool traces) : rng_(seed), traces_(traces) {}

void Schedule::WriteTrace(const std::string& line) const {
  std::cerr << absl::FormatDuration(now_) << ' ' << line << '\n';
}

void Schedule::After(absl::Duration delay, Event event) {
  pending_.push_back({now_ + std::max(delay, absl::ZeroDuration()), std::move(event)});
}

bool Schedule::RunNext() {
  if (pending_.empty()) return false;
  const auto next = std::min_element(pending_.begin(), pending_.end(),
                                     [](const auto& a, const auto& b) { return a.due < b.due; });
  now_ = std::max(now_, next->due);
  std::vector<size_t> due;
  for (size_t i = 0; i < pending_.size(); ++i) {
    if (pending_[i].due <= now_) due.push_back(i);
  }
  const size_t chosen = due[Pick(0, static_cast<int64_t>(due.size()) - 1)];
  Event event = std::move(pending_[chosen].event);
  pending_.erase(pending_.begin() + static_cast<ptrdiff_t>(chosen));
  // Work takes time, so that events which are due a little later compete with the next one.
  now_ += absl::Microseconds(Pick(1, 2000));
  ++num_run_;
  std::move(event)();
  return true;
}

bool Schedule::Chance(double probability) {
  return static_cast<double>(rng_() >> 11) * 0x1p-53 < probability;
}

int64_t Schedule::Pick(int64_t low, int64_t high) {
  return low + static_cast<int64_t>(rng_() % static_cast<uint64_t>(high - low + 1));
}

absl::Duration Schedule::Pick(absl::Duration low, absl::Duration high) {
  return absl::Microseconds(Pick(absl::ToInt64Microseconds(low), absl::ToInt64Microseconds(high)));
}

absl::Time Schedule::Wall() const { return kBegin + now_; }

absl::Duration Schedule::SinceBoot() const { return absl::Hours(1) + now_; }

absl::StatusOr<std::unique_ptr<Executor::Running>> Schedule::Start(ThreadName /*name*/, Step step) {
  auto loop = std::make_unique<SimulatedLoop>(this, std::move(step));
  loop->Wake();
  return loop;
}

}  // namespace hypermap::histories
