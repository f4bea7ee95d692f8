#include "server/session/late_observations.h"

#include <algorithm>

#include "absl/status/statusor.h"
#include "base/cancellation/cancellation.h"
#include "base/status/unless_memory_fails.h"

namespace hypermap::server {
namespace {

// Entries that a commit may fold again: tens of milliseconds.
constexpr int64_t kFewEntries = 64;
// Observations for which more entries must be folded are very late: seconds.
constexpr int64_t kNearEntries = 4096;
// Observations of a portion: one commit judges and stores them all.
constexpr size_t kMaxPortion = 256;
// A work begins when no other late observations have come for kPause, or one has waited for
// kMaxPause. When a server restarts, robots come back within a second.
constexpr absl::Duration kPause = absl::Milliseconds(100);
constexpr absl::Duration kMaxPause = absl::Milliseconds(500);

bool HasGone(const ObservationSubmission& submission) {
  return submission.cancellation && submission.cancellation->LookNow();
}

}  // namespace

std::set<LateObservations::Robot> LateObservations::RobotsOf(
    const ObservationSubmission& submission) {
  std::set<Robot> robots;
  for (const Observation& observation : submission.observations) {
    robots.emplace(submission.layer, observation.robot);
  }
  return robots;
}

bool LateObservations::TakeIfLate(const Snapshot& snapshot, Waiting& waiting) {
  const ObservationSubmission& submission = waiting.submission;
  // The commit finds the error again.
  const int64_t entries =
      fusion_->EntriesToFold(snapshot, submission.layer, submission.observations).value_or(0);
  const bool is_late = entries > kFewEntries;
  if (!is_late && robots_.empty()) return false;
  const std::set<Robot> robots = RobotsOf(submission);
  const bool must_wait = is_late || std::any_of(robots.begin(), robots.end(), [&](const Robot& r) {
                           return robots_.count(r) > 0;
                         });
  if (!must_wait) return false;
  for (const Robot& robot : robots) ++robots_[robot];
  waiting_.push_back({std::move(waiting), entries > kNearEntries ? Lane::kFar : Lane::kNear,
                      is_late, executor_->Now()});
  return true;
}

absl::Duration LateObservations::UntilWork() const {
  if (is_working()) return absl::ZeroDuration();
  if (waiting_.empty()) return absl::InfiniteDuration();
  const SteadyTime now = executor_->Now();
  return std::min(waiting_.back().since + kPause - now, waiting_.front().since + kMaxPause - now);
}

void LateObservations::Gather(Lane lane) {
  Portion& portion = this->portion(lane);
  // Robots of which an earlier submission is not in this portion.
  std::set<Robot> held_up;
  for (const Waiting& other : lanes_[1 - static_cast<int>(lane)].submissions) {
    held_up.merge(RobotsOf(other.submission));
  }
  // Each client gets its share, so that one with many does not fill the portion.
  std::map<std::string, size_t> of_client;
  for (const Entry& entry : waiting_) of_client.emplace(entry.waiting.submission.client, 0);
  const size_t share = std::max<size_t>(1, kMaxPortion / std::max<size_t>(1, of_client.size()));
  size_t taken = 0;
  for (auto it = waiting_.begin(); it != waiting_.end() && taken < kMaxPortion;) {
    const ObservationSubmission& submission = it->waiting.submission;
    std::set<Robot> robots = RobotsOf(submission);
    size_t& own = of_client[submission.client];
    const bool fits =
        (it->lane == lane || !it->is_late) && own < share &&
        (portion.empty() || portion.submissions.front().submission.layer == submission.layer) &&
        std::none_of(robots.begin(), robots.end(),
                     [&](const Robot& robot) { return held_up.count(robot) > 0; });
    if (!fits) {
      held_up.merge(robots);
      ++it;
      continue;
    }
    own += submission.observations.size();
    taken += submission.observations.size();
    portion.submissions.push_back(std::move(it->waiting));
    it = waiting_.erase(it);
  }
}

std::vector<LateObservations::Waiting> LateObservations::End(Portion& portion) {
  std::vector<Waiting> ended = std::move(portion.submissions);
  portion = Portion();
  for (const Waiting& waiting : ended) {
    for (const Robot& robot : RobotsOf(waiting.submission)) {
      const auto it = robots_.find(robot);
      if (--it->second == 0) robots_.erase(it);
    }
  }
  return ended;
}

std::vector<LateObservations::Waiting> LateObservations::WorkFor(Lane lane,
                                                                 const Snapshot& snapshot,
                                                                 absl::FunctionRef<bool()> stop) {
  Portion& portion = this->portion(lane);
  if (portion.empty()) Gather(lane);
  if (portion.empty()) return {};
  const bool all_have_gone =
      std::all_of(portion.submissions.begin(), portion.submissions.end(),
                  [](const Waiting& waiting) { return HasGone(waiting.submission); });
  if (all_have_gone) {
    fusion_->DropLate(portion.submissions.front().submission.layer, lane);
    return End(portion);
  }
  std::vector<FusedLayer::LateObservation> observations;
  for (const Waiting& waiting : portion.submissions) {
    for (const Observation& observation : waiting.submission.observations) {
      observations.push_back({&observation, *waiting.submission.judged_at});
    }
  }
  const bool begin = !std::exchange(portion.has_begun, true);
  const absl::StatusOr<int64_t> left = UnlessMemoryFails([&] {
    return fusion_->FoldLate(snapshot, portion.submissions.front().submission.layer, lane, begin,
                             observations, stop);
  });
  // The commit finds the error again.
  portion.left = left.value_or(0);
  if (portion.left > kFewEntries) return {};
  // The work counts all of them: one that was not committed would make it worthless for the others.
  for (Waiting& waiting : portion.submissions) waiting.submission.cancellation = nullptr;
  return End(portion);
}

std::vector<LateObservations::Waiting> LateObservations::Work(const Snapshot& snapshot,
                                                              absl::FunctionRef<bool()> stop) {
  if (UntilWork() > absl::ZeroDuration()) return {};
  const Portion& far = portion(Lane::kFar);
  // A commit of near ones makes the far ones begin again from there. So none begins while the far
  // ones have come so far.
  const bool far_ends = !far.empty() && far.left <= kNearEntries;
  for (int i = 0; i < FusedLayer::kNumLanes; ++i) {
    const Lane lane = next_;
    next_ = lane == Lane::kNear ? Lane::kFar : Lane::kNear;
    if (lane == Lane::kNear && far_ends && portion(lane).empty()) continue;
    std::vector<Waiting> ready = WorkFor(lane, snapshot, stop);
    if (!ready.empty() || !portion(lane).empty()) return ready;
  }
  return {};
}

std::vector<LateObservations::Waiting> LateObservations::TakeAll() {
  std::vector<Waiting> all;
  for (Portion& portion : lanes_) {
    for (Waiting& waiting : End(portion)) all.push_back(std::move(waiting));
  }
  for (Entry& entry : waiting_) all.push_back(std::move(entry.waiting));
  waiting_.clear();
  robots_.clear();
  return all;
}

}  // namespace hypermap::server
