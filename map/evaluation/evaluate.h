// A map's objects against the truth.
//
// Objects are paired by class: only those whose labels are the same once folded (FoldLabel), and
// whose centroids lie within `max_distance_m` of each other, both ends counted. Each object is in
// one pair at most. Of all such pairings the one with the most pairs is taken; of these the one
// with the greatest sum of IoU; of these the one with the least sum of centroid distances. So a
// pair with no overlap at all counts when there is no other way to count it, and costs its IoU of
// 0.
//
// A truth object in a pair is detected (TP), one in none is missed (FN); a map object in none, of
// whatever class, is a false positive (FP). With m pairs:
//
//   recall = m / truth, precision = m / map, F1 their harmonic mean,
//   PQ = sum of IoU over the pairs / (TP + FP / 2 + FN / 2)
//        (panoptic quality: Kirillov et al., "Panoptic Segmentation", CVPR 2019, equation 1),
//   means of IoU and of the centroids' distance over the pairs (0 where there is none).
//
// PQ at IoU > 0.25 pairs anew, with a second condition on a pair. The means by size tell large and
// small footprints apart by the truth's area.
#ifndef HYPERMAP_MAP_EVALUATION_EVALUATE_H_
#define HYPERMAP_MAP_EVALUATION_EVALUATE_H_

#include <string>
#include <vector>

#include "map/geometry/polygon.h"

namespace hypermap::evaluation {

struct Object {
  std::string label;
  Polygon polygon;
  // Probability that it is there, in [0, 1]; of truth not looked at.
  double existence = 1.0;
};

struct Options {
  double max_distance_m = 1.0;
  // What a pair's IoU must exceed for `pq_iou25`.
  double min_iou = 0.25;
  // Truth footprints above this area are large.
  double large_area_m2 = 0.1;
  // Of equal width, for the calibration.
  int reliability_bins = 10;
};

struct ClassScore {
  std::string label;  // folded
  int truth = 0;
  int map = 0;
  int detected = 0;
  double mean_iou = 0.0;
  double centroid_error_m = 0.0;
};

// A truth object and the map object that stands for it, by index.
struct Pair {
  int truth = 0;
  int map = 0;
  double iou = 0.0;
  double distance_m = 0.0;  // between the centroids
};

// Map objects whose stated existence lies in [low, high), the last bin closed.
struct ReliabilityBin {
  double low = 0.0;
  double high = 0.0;
  int count = 0;
  double mean_existence = 0.0;
  double matched = 0.0;  // the share of them that is in a pair
};

// Whether an existence of 0.8 is right in 8 cases of 10. All 0 for a map without objects.
struct Calibration {
  std::vector<ReliabilityBin> bins;  // those that are not empty
  // Mean of |mean_existence - matched| over the objects, bin by bin (Naeini et al., AAAI 2015).
  double expected_error = 0.0;
  // Mean of (existence - 1 or 0)^2 over the objects (Brier 1950).
  double brier = 0.0;
};

struct Evaluation {
  int n_truth = 0;
  int n_map = 0;
  int tp = 0;
  double recall = 0.0;
  double precision = 0.0;
  double f1 = 0.0;
  double pq = 0.0;
  double pq_iou25 = 0.0;
  double mean_iou = 0.0;
  double mean_iou_large = 0.0;
  double mean_iou_small = 0.0;
  double centroid_error_m = 0.0;
  // Map objects in no pair that overlap a detected truth object of their class, or have their
  // centroid within max_distance_m of its; and the other ones in no pair.
  int duplicates = 0;
  int spurious = 0;
  std::vector<ClassScore> per_class;  // of every class in truth or map, by label
  Calibration calibration;
  std::vector<Pair> pairs;  // by truth
};

// Cubic in the objects of one class.
Evaluation Evaluate(const std::vector<Object>& truth, const std::vector<Object>& map,
                    const Options& options = {});

}  // namespace hypermap::evaluation

#endif  // HYPERMAP_MAP_EVALUATION_EVALUATE_H_
