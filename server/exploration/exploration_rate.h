// How fast an exploration goes on.
#ifndef HYPERMAP_SERVER_EXPLORATION_EXPLORATION_RATE_H_
#define HYPERMAP_SERVER_EXPLORATION_EXPLORATION_RATE_H_

#include <algorithm>
#include <cstdint>
#include <deque>

#include "absl/time/time.h"

namespace hypermap::server {

// Keeps what was explored when somebody asked, a minute back, in memory only.
class ExplorationRate {
 public:
  // So many cells are explored.
  void Add(absl::Time now, int64_t explored) {
    newest_ = {now, explored};
    if (samples_.empty() || now - samples_.back().time >= kSpacing) samples_.push_back(newest_);
    // One that is older stays, to tell what was explored since.
    while (samples_.size() > 1 && now - samples_[1].time >= kMinute) samples_.pop_front();
  }

  // In the last minute, or since the sample before it; 0 when nobody asked before, or cells were
  // taken back.
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
