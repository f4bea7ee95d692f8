#include "map/fusion/evidence_facts.h"

#include <utility>

#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"

namespace hypermap::fusion {
namespace {

// Least IoU of a track with the operator's object for the two to be the same thing. It equals the
// default overlap at which two tracks of one class are merged (EvidenceParameters::merge_iou).
constexpr double kSameIou = 0.3;
// The height of an object for which the operator gave none. Wide, so that detections at any usual
// height overlap it; it could be a parameter for sites where things hang higher.
constexpr HeightRange kAnyHeight{0.0, 2.0};

size_t Find(const EvidenceState& state, const OperatorFact& fact) {
  const Polygon footprint = FootprintOf(fact.object.shape, kPinHalfWidth_m);
  size_t best = state.tracks.size();
  double best_score = kSameIou;
  for (size_t i = 0; i < state.tracks.size(); ++i) {
    const Track& track = *state.tracks[i];
    if (track.key == fact.track) return i;
    const Polygon shown =
        track.object ? FootprintOf(track.object->shape, kPinHalfWidth_m) : track.outline;
    if (!shown.bounds().Intersects(footprint.bounds())) continue;
    double score = Iou(shown, footprint);
    // A track with the fact's label is preferred to all others.
    if (score >= kSameIou && track.label() == fact.object.label) score += 1.0;
    if (score >= best_score) {
      best_score = score;
      best = i;
    }
  }
  return best;
}

}  // namespace

std::shared_ptr<const EvidenceState> FoldFact(const EvidenceState& before, const OperatorFact& fact,
                                              const EvidenceParameters& parameters) {
  auto after = std::make_shared<EvidenceState>(before);
  const size_t found = Find(before, fact);
  auto track = std::make_shared<Track>();
  if (found < before.tracks.size()) {
    *track = *before.tracks[found];
  } else {
    track->key = fact.track;
    // Not InfinitePast, which nanoseconds in an encoded state could not represent.
    track->last_hit = absl::UnixEpoch();
    track->shape = ShapeGrid(parameters.fine_cell_m);
    track->class_mass[fact.object.label] = 1.0;
    const HeightRange height = fact.object.height.value_or(kAnyHeight);
    track->low.Add(height.low_m, 1.0, -1.0);
    track->high.Add(height.high_m, 1.0, 1.0);
    track->outline = FootprintOf(fact.object.shape, kPinHalfWidth_m);
  }
  // An operator's word counts as much as any number of detections.
  track->log_odds = parameters.max_log_odds;
  if (fact.kind == OperatorFact::Kind::kPin) {
    auto pinned = std::make_shared<SemanticObject>(fact.object);
    pinned->id = 0;
    track->pinned = std::move(pinned);
    track->removed = false;
  } else {
    track->pinned = nullptr;
    track->removed = true;
  }
  track->Refresh(parameters);
  if (found < before.tracks.size()) {
    after->tracks[found] = std::move(track);
  } else {
    after->tracks.push_back(std::move(track));
  }
  return after;
}

}  // namespace hypermap::fusion
