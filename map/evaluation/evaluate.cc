#include "map/evaluation/evaluate.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "map/evaluation/pairing.h"
#include "map/geometry/overlap.h"
#include "map/values/value_query.h"

namespace hypermap::evaluation {
namespace {

double Ratio(double part, double whole) { return whole > 0.0 ? part / whole : 0.0; }

double DistanceBetween(const Point& a, const Point& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// A running mean.
struct Mean {
  double sum = 0.0;
  int count = 0;

  void Add(double v) {
    sum += v;
    ++count;
  }
  double value() const { return Ratio(sum, count); }
};

// An object with the values that are computed only once.
struct Prepared {
  explicit Prepared(const Object& object)
      : label(FoldLabel(object.label)), polygon(&object.polygon), centroid(Centroid(*polygon)) {}

  std::string label;
  const Polygon* polygon;
  Point centroid;
};

std::vector<Prepared> Prepare(const std::vector<Object>& objects) {
  return std::vector<Prepared>(objects.begin(), objects.end());
}

// Returns every pair of the same class within the distance, with IoU as gain and distance as cost.
std::vector<Candidate> CandidatesOf(const std::vector<Prepared>& truth,
                                    const std::vector<Prepared>& map, double max_distance_m) {
  std::map<std::string, std::vector<size_t>> map_by_label;
  for (size_t i = 0; i < map.size(); ++i) map_by_label[map[i].label].push_back(i);
  std::vector<Candidate> candidates;
  for (size_t t = 0; t < truth.size(); ++t) {
    for (const size_t m : map_by_label[truth[t].label]) {
      const double distance_m = DistanceBetween(truth[t].centroid, map[m].centroid);
      if (!(distance_m <= max_distance_m)) continue;
      candidates.push_back({static_cast<int>(t), static_cast<int>(m),
                            Iou(*truth[t].polygon, *map[m].polygon), distance_m});
    }
  }
  return candidates;
}

double PanopticQuality(const std::vector<Candidate>& pairs, size_t n_truth, size_t n_map) {
  double sum = 0.0;
  for (const Candidate& pair : pairs) sum += pair.gain;
  // TP + FP / 2 + FN / 2, as each pair takes one object of either side.
  return Ratio(sum, 0.5 * static_cast<double>(n_truth + n_map));
}

// Returns PQ over pairs whose IoU exceeds `min_iou`.
double StrictPanopticQuality(std::vector<Candidate> candidates, double min_iou, size_t n_truth,
                             size_t n_map) {
  std::erase_if(candidates, [min_iou](const Candidate& c) { return !(c.gain > min_iou); });
  return PanopticQuality(BestPairing(candidates), n_truth, n_map);
}

std::vector<ClassScore> ScoreClasses(const std::vector<Prepared>& truth,
                                     const std::vector<Prepared>& map,
                                     const std::vector<Pair>& pairs) {
  std::map<std::string, ClassScore> by_label;
  for (const Prepared& object : truth) ++by_label[object.label].truth;
  for (const Prepared& object : map) ++by_label[object.label].map;
  for (const Pair& pair : pairs) {
    ClassScore& score = by_label[truth[pair.truth].label];
    ++score.detected;
    score.mean_iou += pair.iou;
    score.centroid_error_m += pair.distance_m;
  }
  std::vector<ClassScore> scores;
  for (auto& [label, score] : by_label) {
    score.label = label;
    score.mean_iou = Ratio(score.mean_iou, score.detected);
    score.centroid_error_m = Ratio(score.centroid_error_m, score.detected);
    scores.push_back(score);
  }
  return scores;
}

std::vector<bool> PairedInMap(const std::vector<Pair>& pairs, size_t n_map) {
  std::vector<bool> paired(n_map, false);
  for (const Pair& pair : pairs) paired[pair.map] = true;
  return paired;
}

// Returns the number of map objects without a partner that repeat a truth object that is already
// detected.
int CountDuplicates(const std::vector<Prepared>& truth, const std::vector<Prepared>& map,
                    const std::vector<Pair>& pairs, double max_distance_m) {
  const std::vector<bool> paired = PairedInMap(pairs, map.size());
  int duplicates = 0;
  for (size_t m = 0; m < map.size(); ++m) {
    if (paired[m]) continue;
    duplicates += std::any_of(pairs.begin(), pairs.end(), [&](const Pair& pair) {
      const Prepared& detected = truth[pair.truth];
      return detected.label == map[m].label &&
             (DistanceBetween(detected.centroid, map[m].centroid) <= max_distance_m ||
              IntersectionArea(*detected.polygon, *map[m].polygon) > 0.0);
    });
  }
  return duplicates;
}

Calibration Calibrate(const std::vector<Object>& map, const std::vector<Pair>& pairs,
                      int num_bins) {
  const std::vector<bool> paired = PairedInMap(pairs, map.size());
  std::vector<Mean> existence(num_bins), matched(num_bins);
  Mean brier;
  for (size_t m = 0; m < map.size(); ++m) {
    const double stated = map[m].existence;
    const double happened = paired[m] ? 1.0 : 0.0;
    const int bin = std::clamp(static_cast<int>(stated * num_bins), 0, num_bins - 1);
    existence[bin].Add(stated);
    matched[bin].Add(happened);
    brier.Add((stated - happened) * (stated - happened));
  }
  Calibration calibration{.brier = brier.value()};
  for (int i = 0; i < num_bins; ++i) {
    const int count = existence[i].count;
    if (count == 0) continue;
    calibration.bins.push_back({static_cast<double>(i) / num_bins,
                                static_cast<double>(i + 1) / num_bins, count, existence[i].value(),
                                matched[i].value()});
    calibration.expected_error += std::abs(existence[i].value() - matched[i].value()) * count /
                                  static_cast<double>(map.size());
  }
  return calibration;
}

void AddMeans(const std::vector<Object>& truth, double large_area_m2, Evaluation& evaluation) {
  Mean all, large, small, distance;
  for (const Pair& pair : evaluation.pairs) {
    all.Add(pair.iou);
    (Area(truth[pair.truth].polygon) > large_area_m2 ? large : small).Add(pair.iou);
    distance.Add(pair.distance_m);
  }
  evaluation.mean_iou = all.value();
  evaluation.mean_iou_large = large.value();
  evaluation.mean_iou_small = small.value();
  evaluation.centroid_error_m = distance.value();
}

}  // namespace

Evaluation Evaluate(const std::vector<Object>& truth_objects,
                    const std::vector<Object>& map_objects, const Options& options) {
  const std::vector<Prepared> truth = Prepare(truth_objects);
  const std::vector<Prepared> map = Prepare(map_objects);
  const std::vector<Candidate> candidates = CandidatesOf(truth, map, options.max_distance_m);
  const std::vector<Candidate> best = BestPairing(candidates);

  Evaluation e;
  e.n_truth = static_cast<int>(truth.size());
  e.n_map = static_cast<int>(map.size());
  e.tp = static_cast<int>(best.size());
  for (const Candidate& c : best) e.pairs.push_back({c.left, c.right, c.gain, c.cost});
  e.recall = Ratio(e.tp, e.n_truth);
  e.precision = Ratio(e.tp, e.n_map);
  e.f1 = Ratio(2.0 * e.tp, e.n_truth + e.n_map);
  e.pq = PanopticQuality(best, truth.size(), map.size());
  e.pq_iou25 = StrictPanopticQuality(candidates, options.min_iou, truth.size(), map.size());
  AddMeans(truth_objects, options.large_area_m2, e);
  e.duplicates = CountDuplicates(truth, map, e.pairs, options.max_distance_m);
  e.spurious = e.n_map - e.tp - e.duplicates;
  e.per_class = ScoreClasses(truth, map, e.pairs);
  e.calibration = Calibrate(map_objects, e.pairs, options.reliability_bins);
  return e;
}

}  // namespace hypermap::evaluation
