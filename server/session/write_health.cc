#include "server/session/write_health.h"

#include <algorithm>

#include "base/logging/log.h"

namespace hypermap::server {

void WriteHealth::Note(const absl::Status& written, absl::Duration now) {
  if (absl::IsCancelled(written) || absl::IsDeadlineExceeded(written)) return;
  const MutexLock lock(&mutex_);
  if (written.ok()) {
    if (problem_.ok()) return;
    logging::Log(logging::Level::kInfo, "map takes changes again", {{"map", map_}});
    problem_ = absl::OkStatus();
    pause_ = kFirstTrial;
    next_trial_ = absl::InfiniteDuration();
    return;
  }
  if (problem_.ok()) {
    logging::Log(logging::Level::kWarning, "map takes no changes",
                 {{"map", map_}, {"problem", written.ToString()}});
  } else if (now >= next_trial_) {
    pause_ = std::min(2 * pause_, kLastTrial);
  }
  problem_ = written;
  next_trial_ = now + pause_;
}

absl::Status WriteHealth::problem() const {
  const MutexLock lock(&mutex_);
  return problem_;
}

absl::Duration WriteHealth::next_trial() const {
  const MutexLock lock(&mutex_);
  return next_trial_;
}

}  // namespace hypermap::server
