#include "map/fusion/evidence_step.h"

#include <algorithm>
#include <bit>

#include "map/fusion/evidence_align.h"
#include "map/fusion/evidence_hit.h"

namespace hypermap::fusion {
namespace {

bool AreSame(double a, double b) {
  return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b);
}

// Returns whether the state has the tracks that the step found near its observation, but for
// log-odds that make no difference to the alignment.
bool IsSameNearby(const EvidenceStep& step, const EvidenceState& before,
                  const std::vector<TrackList::Position>& positions) {
  if (positions.size() + step.num_founded != step.tracks.size()) return false;
  for (size_t i = 0; i < positions.size(); ++i) {
    const TrackPtr& was = step.tracks[i].before;
    const TrackPtr& is = before.tracks.At(positions[i]);
    if (was == is) continue;
    if (EqualButForOdds(was) != EqualButForOdds(is)) return false;
    if (IsReference(was->log_odds) != IsReference(is->log_odds)) return false;
  }
  return true;
}

// Returns the log-odds of the step's tracks after it.
std::vector<double> LogOddsAfter(const EvidenceStep& step, const EvidenceState& before,
                                 const std::vector<TrackList::Position>& positions,
                                 const EvidenceParameters& parameters) {
  std::vector<double> log_odds;
  log_odds.reserve(step.tracks.size());
  for (size_t i = 0; i < step.tracks.size(); ++i) {
    const EvidenceStep::Affected& track = step.tracks[i];
    double& own =
        log_odds.emplace_back(i < positions.size() ? before.tracks.At(positions[i])->log_odds
                                                   : parameters.founding_log_odds);
    if (track.score) own = LogOddsAfterHit(own, *track.score, before.ranks, parameters);
    if (track.loss) own -= *track.loss;
  }
  for (const auto& [from, into] : step.merged) {
    log_odds[into] = AbsorbedLogOdds(log_odds[into], log_odds[from], parameters);
  }
  return log_odds;
}

TrackPtr WithLogOdds(const TrackPtr& track, double log_odds, const EvidenceParameters& parameters) {
  if (AreSame(track->log_odds, log_odds)) return track;
  auto changed = std::make_shared<Track>(*track);
  if (!changed->but_for_odds) changed->but_for_odds = track;
  changed->log_odds = log_odds;
  changed->RefreshObject(parameters);
  return changed;
}

}  // namespace

int64_t EvidenceStep::bytes() const {
  auto bytes = static_cast<int64_t>(sizeof(*this) + tracks.size() * sizeof(Affected) +
                                    view.robot.size() + scores.size() * sizeof(double));
  for (const Affected& track : tracks) {
    if (!track.after || track.after == track.before) continue;
    bytes += ByteSize(*track.after);
    if (track.before && track.before->shape.SharesCellsWith(track.after->shape)) {
      bytes -= track.after->shape.bytes();
    }
  }
  return bytes;
}

std::shared_ptr<const EvidenceState> Repeated(const EvidenceStep& step, const EvidenceState& before,
                                              const EvidenceParameters& parameters) {
  const std::vector<TrackList::Position> positions = before.tracks.Intersecting(step.box);
  if (!IsSameNearby(step, before, positions)) return nullptr;
  const std::vector<double> log_odds = LogOddsAfter(step, before, positions, parameters);
  std::vector<bool> merged(step.tracks.size(), false);
  for (const auto& [from, into] : step.merged) merged[from] = true;
  for (size_t i = 0; i < step.tracks.size(); ++i) {
    const bool is_gone = merged[i] || log_odds[i] < parameters.delete_log_odds;
    if (is_gone != (step.tracks[i].after == nullptr)) return nullptr;
  }
  auto after = std::make_shared<EvidenceState>(before);
  std::vector<TrackList::Change> changes;
  for (size_t i = 0; i < positions.size(); ++i) {
    const EvidenceStep::Affected& track = step.tracks[i];
    if (track.after == track.before) continue;
    changes.push_back(
        {positions[i], track.after ? WithLogOdds(track.after, log_odds[i], parameters) : nullptr});
  }
  after->tracks.Replace(changes);
  for (size_t i = positions.size(); i < step.tracks.size(); ++i) {
    const TrackPtr& founded = step.tracks[i].after;
    if (founded) after->tracks.push_back(WithLogOdds(founded, log_odds[i], parameters));
  }
  after->views.Add(step.view);
  for (const double score : step.scores) after->ranks.Add(score);
  return after;
}

}  // namespace hypermap::fusion
