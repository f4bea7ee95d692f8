// The rate at which an exploration explores cells.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_RATE_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_RATE_H_

#include <algorithm>
#include <cstdint>
#include <deque>

#include "absl/time/time.h"

namespace hypermap::server {

// Mean rate over the last minute, from samples that are taken when a call needs the progress. Keeps
// at most one sample per second. Not thread safe.
class ExplorationRate {
 public:
  // Adds a sample: `explored` is the total number of explored cells at `now`.
  void Add(absl::Time now, int64_t explored) {
    newest_ = {now, explored};
    if (samples_.empty() || now - samples_.back().time >= kSpacing) samples_.push_back(newest_);
    // The newest of the samples that are older than a minute stays: the rate is measured from it.
    while (samples_.size() > 1 && now - samples_[1].time >= kMinute) samples_.pop_front();
  }

  // Explored cells per second since the oldest sample; 0 if there is no earlier sample, or if cells
  // became unexplored.
  double cells_per_s() const {
    if (samples_.empty()) return 0.0;
    const double seconds = absl::ToDoubleSeconds(newest_.time - samples_.front().time);
    const auto cells = static_cast<double>(newest_.explored - samples_.front().explored);
    return seconds > 0.0 ? std::max(cells, 0.0) / seconds : 0.0;
  }

 private:
  static constexpr absl::Duration kMinute = absl::Minutes(1);
  static constexpr absl::Duration kSpacing = absl::Seconds(1);

  struct Sample {
    absl::Time time;
    int64_t explored = 0;
  };
  std::deque<Sample> samples_;
  Sample newest_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_EXPLORATION_EXPLORATION_RATE_H_
