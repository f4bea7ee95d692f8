#include "map/fusion/evidence_facts.h"

#include <optional>
#include <utility>
#include <vector>

#include "base/cancellation/cancellation.h"
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

// Returns the area of a track with which a fact's object is compared.
Polygon AreaOf(const Track& track) {
  return track.object ? FootprintOf(track.object->shape, kPinHalfWidth_m) : track.outline;
}

std::shared_ptr<Track> TrackFoundedBy(const OperatorFact& fact, const Polygon& footprint,
                                      const EvidenceParameters& parameters) {
  auto track = std::make_shared<Track>();
  track->key = fact.track;
  // Not InfinitePast, which nanoseconds in an encoded state could not represent.
  track->last_hit = absl::UnixEpoch();
  track->shape = ShapeGrid(parameters.fine_cell_m);
  track->class_mass[fact.object.label] = 1.0;
  const HeightRange height = fact.object.height.value_or(kAnyHeight);
  track->low.Add(height.low_m, 1.0, -1.0);
  track->high.Add(height.high_m, 1.0, 1.0);
  track->outline = footprint;
  return track;
}

}  // namespace

EvidenceFacts::EvidenceFacts(const EvidenceState& before, const EvidenceParameters& parameters)
    : parameters_(parameters), after_(std::make_shared<EvidenceState>(before)) {
  index_.Reserve(after_->tracks.size());
  tracks_.reserve(after_->tracks.size());
  after_->tracks.ForEach([&](const TrackPtr& track) { tracks_.push_back(track); });
  for (const TrackPtr& track : tracks_) {
    if (IsCancelled()) return;
    index_.Add(track->key, AreaOf(*track).bounds());
  }
}

void EvidenceFacts::Add(const OperatorFact& fact) {
  const Polygon footprint = FootprintOf(fact.object.shape, kPinHalfWidth_m);
  const std::optional<size_t> found =
      index_.Find(fact.track, footprint.bounds(), kSameIou, [&](size_t i) {
        const double iou = Iou(AreaOf(*tracks_[i]), footprint);
        // A track with the fact's label is preferred to all others.
        return iou >= kSameIou && tracks_[i]->label() == fact.object.label ? iou + 1.0 : iou;
      });
  const std::shared_ptr<Track> track =
      found ? CopyToChange(*tracks_[*found]) : TrackFoundedBy(fact, footprint, parameters_);
  // An operator's word counts as much as any number of detections.
  track->log_odds = parameters_.max_log_odds;
  if (fact.kind == OperatorFact::Kind::kPin) {
    auto pinned = std::make_shared<SemanticObject>(fact.object);
    pinned->id = 0;
    track->pinned = std::move(pinned);
    track->removed = false;
  } else {
    track->pinned = nullptr;
    track->removed = true;
  }
  track->Refresh(parameters_);
  if (found) {
    index_.Move(*found, AreaOf(*track).bounds());
    tracks_[*found] = track;
    after_->tracks.Set(*found, track);
  } else {
    index_.Add(track->key, AreaOf(*track).bounds());
    tracks_.push_back(track);
    after_->tracks.push_back(track);
  }
}

}  // namespace hypermap::fusion
