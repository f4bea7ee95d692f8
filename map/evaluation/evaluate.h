// Scores a map's objects against ground truth.
//
// Objects are paired one to one, by class: labels must be equal once folded (FoldLabel), and
// centroids at most `max_distance_m` apart. Of all such pairings, the one with the most pairs is
// used; of these, the one with the greatest sum of IoU; of these, the one with the least sum of
// centroid distances. Therefore two objects that do not overlap may form a pair, which counts with
// its IoU of 0.
//
// A truth object in a pair is detected (TP), and one without a partner is missed (FN). A map object
// without a partner, of whatever class, is a false positive (FP). With m pairs:
//
//   recall = m / truth, precision = m / map, F1 their harmonic mean,
//   PQ = sum of IoU over the pairs / (TP + FP / 2 + FN / 2)
//        (panoptic quality: Kirillov et al., "Panoptic Segmentation", CVPR 2019, equation 1),
//   means of IoU and of centroid distance over the pairs (0 if there are none).
//
// PQ at IoU > 0.25 is computed from a new pairing with this additional condition. The means by size
// separate large and small footprints by the area of the truth object.
#ifndef HYPERMAP_MAP_EVALUATION_EVALUATE_H_
#define HYPERMAP_MAP_EVALUATION_EVALUATE_H_

#include <string>
#include <vector>

#include "map/geometry/polygon.h"

namespace hypermap::evaluation {

struct Object {
  std::string label;
  Polygon polygon;
  // Probability in [0, 1] that the object is there; not used for truth objects.
  double existence = 1.0;
};

struct Options {
  double max_distance_m = 1.0;
  // IoU that a pair must exceed for `pq_iou25`.
  double min_iou = 0.25;
  // Truth footprints above this area count as large.
  double large_area_m2 = 0.1;
  // Number of bins of equal width for the calibration.
  int reliability_bins = 10;
};

struct ClassScore {
  std::string label;  // Folded.
  int truth = 0;
  int map = 0;
  int detected = 0;
  double mean_iou = 0.0;
  double centroid_error_m = 0.0;
};

// A truth object and the map object that it is paired with, by index.
struct Pair {
  int truth = 0;
  int map = 0;
  double iou = 0.0;
  double distance_m = 0.0;  // Between the centroids.
};

// Map objects whose stated existence is in [low, high); the last bin is closed.
struct ReliabilityBin {
  double low = 0.0;
  double high = 0.0;
  int count = 0;
  double mean_existence = 0.0;
  double matched = 0.0;  // Share of these objects that are in a pair.
};

// Calibration of the stated existence: 0.8 should be right in 8 cases of 10. All 0 for a map
// without objects.
struct Calibration {
  std::vector<ReliabilityBin> bins;  // Bins that are not empty.
  // Mean of |mean_existence - matched| over the objects, with the values of their bins (Naeini et
  // al., AAAI 2015).
  double expected_error = 0.0;
  // Mean of (existence - outcome)^2 over the objects, where outcome is 1 for objects in a pair and
  // otherwise 0 (Brier 1950).
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
  // Map objects without a partner. Duplicates overlap a detected truth object of their class, or
  // have a centroid within max_distance_m of its centroid; the others are spurious.
  int duplicates = 0;
  int spurious = 0;
  std::vector<ClassScore> per_class;  // Every class in truth or map, by label.
  Calibration calibration;
  std::vector<Pair> pairs;  // Sorted by truth.
};

// Cubic in the number of objects of one class.
Evaluation Evaluate(const std::vector<Object>& truth, const std::vector<Object>& map,
                    const Options& options = {});

}  // namespace hypermap::evaluation

#endif  // HYPERMAP_MAP_EVALUATION_EVALUATE_H_
