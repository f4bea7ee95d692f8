#include "client_libs/bench/outages.h"

#include "absl/time/time.h"

namespace hypermap::bench {

std::optional<absl::Duration> Outage::Down() const {
  if (!first_answer_after) return std::nullopt;
  return *first_answer_after - last_answer_before;
}

std::optional<absl::Duration> Outage::AllBack() const {
  if (!first_answer_after || !all_back) return std::nullopt;
  return *all_back - *first_answer_after;
}

int OutageLog::AddClient() {
  const MutexLock lock(&mutex_);
  standings_.push_back(Standing::kNotNoticed);
  return static_cast<int>(standings_.size()) - 1;
}

void OutageLog::Answered(int client, SteadyTime at) {
  if (!is_open_.load(std::memory_order_acquire)) {
    // Answers of several threads may be noted in another order, by less than a failure takes.
    last_answer_ns_.store(absl::ToInt64Nanoseconds(at - begin_), std::memory_order_relaxed);
    return;
  }
  const MutexLock lock(&mutex_);
  if (is_open_) AnsweredInOutage(client, at);
}

void OutageLog::AnsweredInOutage(int client, SteadyTime at) {
  Outage& outage = outages_.back();
  Standing& standing = standings_[client];
  if (standing == Standing::kBack) return;
  // An answer that arrives before the first client is back may have been sent before the outage.
  if (standing == Standing::kNotNoticed && !outage.first_answer_after) return;
  if (!outage.first_answer_after) outage.first_answer_after = at;
  standing = Standing::kBack;
  if (--outage.num_waiting > 0) return;
  outage.all_back = at;
  last_answer_ns_ = absl::ToInt64Nanoseconds(at - begin_);
  is_open_.store(false, std::memory_order_release);
}

void OutageLog::Failed(int client, SteadyTime at) {
  const MutexLock lock(&mutex_);
  if (!is_open_) {
    const int64_t last_ns = last_answer_ns_;
    Outage& outage = outages_.emplace_back();
    outage.first_failure = at;
    outage.last_answer_before = last_ns < 0 ? at : begin_ + absl::Nanoseconds(last_ns);
    outage.num_waiting = static_cast<int>(standings_.size());
    standings_.assign(standings_.size(), Standing::kNotNoticed);
    is_open_.store(true, std::memory_order_release);
  }
  Outage& outage = outages_.back();
  Standing& standing = standings_[client];
  if (standing == Standing::kNotNoticed) ++outage.num_failed;
  if (standing == Standing::kBack) ++outage.num_waiting;
  standing = Standing::kFailed;
}

std::vector<Outage> OutageLog::outages() const {
  const MutexLock lock(&mutex_);
  return outages_;
}

}  // namespace hypermap::bench
