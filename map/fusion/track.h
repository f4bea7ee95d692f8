// A thing that the evidence strategy tracks.
#ifndef HYPERMAP_MAP_FUSION_TRACK_H_
#define HYPERMAP_MAP_FUSION_TRACK_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/shape_grid.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

// A soft maximum (s = 1) or minimum (s = -1) of weighted values, the Boltzmann operator:
//   sum(w x exp(s x / scale)) / sum(w exp(s x / scale))
// A plain maximum would keep a single outlier for ever; a mean would miss the ends.
struct SoftExtreme {
  double sum = 0.0;
  double weight = 0.0;

  void Add(double value, double weight, double sign);
  double value() const { return weight > 0.0 ? sum / weight : 0.0; }
};

// A value. States share the tracks that an observation did not affect.
struct Track {
  TrackKey key;
  double log_odds = 0.0;
  int hits = 0;
  absl::Time last_hit = absl::InfinitePast();
  // Accumulated scores of each class.
  std::map<std::string, double> class_mass;
  // The lower and upper end of its range of heights. Soft extremes, because most views show only a
  // part of that range.
  SoftExtreme low;
  SoftExtreme high;
  // Evidence for the cells of its footprint, in the frame of alignment: frames are aligned to each
  // other before their cells are added, so that the shape stays sharp.
  ShapeGrid shape;
  // Weighted sum of the displacements by which alignment moved its detections. Their mean, negated,
  // is shift().
  Point moved_sum;
  double moved_weight = 0.0;
  // Number of clear views of its place (a view less clear counts less), and in how many of them it
  // was detected.
  double looks = 0.0;
  double found = 0.0;
  // Sum of the weights of its detections; divided by `hits`, the clarity of a usual view of it.
  double clarity = 0.0;
  // Number of frames that detected it and, within side_by_side_m, separately another track of the
  // same class, by the other's key. Two detections of one frame are two things.
  std::map<TrackKey, int> apart;
  // The operator's object, if pinned.
  ObjectPtr pinned;
  // An operator said that it is not there.
  bool removed = false;

  // Of a track that a fold has changed in its log_odds only, compared with what an earlier fold
  // made of the same evidence: the result of that one (EvidenceStep). Not part of the value.
  std::shared_ptr<const Track> but_for_odds;

  // Derived from the members above by Refresh.
  Polygon hull;     // The shape's, in the frame of alignment; may be empty.
  Polygon outline;  // The last hull that was not empty, or the operator's footprint.
  ObjectPtr object;

  std::string label() const;
  // Returns the class's share in the evidence for all classes, in [0, 1].
  double ClassShare(const std::string& label) const;
  HeightRange height() const;
  double existence() const;
  // Translation from the frame of alignment to the layer's.
  Point shift() const;

  // Refresh recomputes the derived members. RefreshObject is cheaper and suffices if the shape did
  // not change.
  void Refresh(const EvidenceParameters& parameters);
  void RefreshObject(const EvidenceParameters& parameters);
  // Returns whether the two were detected side by side so often that they must be two things.
  bool IsApartFrom(const Track& other) const;
  // Adds the evidence of another track, which turned out to be of the same thing.
  void Absorb(const Track& other, const EvidenceParameters& parameters);
};

using TrackPtr = std::shared_ptr<const Track>;

// A copy that is going to be changed.
std::shared_ptr<Track> CopyToChange(const Track& track);

// Of two tracks that are given by pointers and of which this is the same, all members are equal but
// for log_odds and what follows from it. Kept alive by the track.
inline const Track* EqualButForOdds(const TrackPtr& track) {
  return track->but_for_odds ? track->but_for_odds.get() : track.get();
}

// The log-odds of a track after it has absorbed one with `other`.
double AbsorbedLogOdds(double log_odds, double other, const EvidenceParameters& parameters);

// Bytes of memory that a track takes: an estimate.
int64_t ByteSize(const Track& track);

// Returns `polygon` translated by (dx, dy).
Polygon Moved(const Polygon& polygon, double dx, double dy);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_TRACK_H_
