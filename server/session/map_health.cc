#include "server/session/map_health.h"

#include <algorithm>
#include <cstddef>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/logging/log.h"

namespace hypermap::server {
namespace {

// Bytes of the description of damage from which on no more is added.
constexpr size_t kMaxDamageText = 2000;

}  // namespace

void MapHealth::NoteWrite(const absl::Status& written, absl::Duration now) {
  if (absl::IsCancelled(written) || absl::IsDeadlineExceeded(written)) return;
  if (absl::IsDataLoss(written)) return NoteDamage(written);
  const MutexLock lock(&mutex_);
  if (written.ok()) {
    if (unwritten_.ok()) return;
    logging::Log(logging::Level::kInfo, "map takes changes again", {{"map", map_}});
    unwritten_ = absl::OkStatus();
    pause_ = kFirstTrial;
    next_trial_ = absl::InfiniteDuration();
    return;
  }
  if (unwritten_.ok()) {
    logging::Log(logging::Level::kWarning, "map takes no changes",
                 {{"map", map_}, {"problem", written.ToString()}});
  } else if (now >= next_trial_) {
    pause_ = std::min(2 * pause_, kLastTrial);
  }
  unwritten_ = written;
  next_trial_ = now + pause_;
}

void MapHealth::NoteDamage(const absl::Status& damage) {
  if (damage.ok()) return;
  const MutexLock lock(&mutex_);
  const absl::string_view known = damage_.message();
  // The calls that meet further damage are logged themselves.
  if (known.size() >= kMaxDamageText || absl::StrContains(known, damage.message())) return;
  logging::Log(logging::Level::kError, "map is damaged",
               {{"map", map_}, {"problem", damage.ToString()}});
  damage_ = absl::DataLossError(absl::StrCat(known, known.empty() ? "" : "; ", damage.message()));
}

MapCondition MapHealth::condition() const {
  const MutexLock lock(&mutex_);
  if (!unwritten_.ok()) return {MapState::kReadOnly, unwritten_};
  if (!damage_.ok()) return {MapState::kDamaged, damage_};
  return {};
}

absl::Duration MapHealth::next_trial() const {
  const MutexLock lock(&mutex_);
  return next_trial_;
}

}  // namespace hypermap::server
