// One thing that the evidence strategy follows.
#ifndef HYPERMAP_MAP_FUSION_TRACK_H_
#define HYPERMAP_MAP_FUSION_TRACK_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "map/fusion/evidence_parameters.h"
#include "map/fusion/shape_grid.h"
#include "map/fusion/strategy.h"

namespace hypermap::fusion {

// sum(w x exp(s x / scale)) / sum(w exp(s x / scale)), s = 1 for the high end, -1 for the low one.
struct SoftExtreme {
  double sum = 0.0;
  double weight = 0.0;

  void Add(double value, double weight, double sign);
  double value() const { return weight > 0.0 ? sum / weight : 0.0; }
};

// A value; the state shares those that an observation left alone.
struct Track {
  TrackKey key;
  double log_odds = 0.0;
  int hits = 0;
  absl::Time last_hit = absl::InfinitePast();
  // How much speaks for each class.
  std::map<std::string, double> class_mass;
  // The ends of its range of heights, as weighted means in which the extreme ones count most: parts
  // of it are seen more often than all of it.
  SoftExtreme low;
  SoftExtreme high;
  // Where the cells are, in the frame in which detections are aligned to each other ...
  ShapeGrid shape;
  // ... which lies off the layer's by the mean of what the detections were moved by.
  Point moved_sum;
  double moved_weight = 0.0;
  // How often it was looked at plainly, and how often of these it was detected.
  double looks = 0.0;
  double found = 0.0;
  // Sum of the weights of the detections: how clear the views are that find it.
  double clarity = 0.0;
  // In how many frames it was detected beside another thing, with hardly an overlap: two detections
  // of one frame are two things.
  std::map<TrackKey, int> apart;
  // The operator's, when pinned.
  ObjectPtr pinned;
  // An operator said that it isn't there.
  bool removed = false;

  // Follow from the above, see Refresh.
  Polygon hull;     // of the shape, in the frame of alignment; may be empty
  Polygon outline;  // the last hull that was not empty, or the operator's
  ObjectPtr object;

  std::string label() const;
  // Share of the class in all that speaks for any, in [0, 1].
  double ClassShare(const std::string& label) const;
  HeightRange height() const;
  double existence() const;
  // From the frame of alignment to the layer's.
  Point shift() const;

  // Recomputes what follows from the evidence; the second for when the shape stayed the same.
  void Refresh(const EvidenceParameters& parameters);
  void RefreshObject(const EvidenceParameters& parameters);
  // Whether the two were seen beside each other so often that they are two things.
  bool IsApartFrom(const Track& other) const;
  // Takes in the evidence of another track of the same thing.
  void Absorb(const Track& other, const EvidenceParameters& parameters);
};

using TrackPtr = std::shared_ptr<const Track>;

// `polygon` moved by (dx, dy).
Polygon Moved(const Polygon& polygon, double dx, double dy);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_TRACK_H_
