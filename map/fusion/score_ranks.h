// Ranks of detection scores.
#ifndef HYPERMAP_MAP_FUSION_SCORE_RANKS_H_
#define HYPERMAP_MAP_FUSION_SCORE_RANKS_H_

#include <array>
#include <cstddef>

namespace hypermap::fusion {

// A histogram of the scores so far, which turns a score into its rank. Detectors differ in the
// meaning of 0.6, but all of them give better detections higher scores, so evidence depends on the
// rank alone. A value.
class ScoreRanks {
 public:
  static constexpr size_t kBins = 256;
  using Counts = std::array<double, kBins>;

  // Starts with a few imaginary scores, evenly spread over [0, 1].
  ScoreRanks();
  explicit ScoreRanks(const Counts& counts) : counts_(counts) {}

  // `score` in [0, 1].
  void Add(double score);

  // Returns the share of scores that are lower, with equal ones counted half; in (0, 1).
  double Rank(double score) const;

  const Counts& counts() const { return counts_; }

 private:
  Counts counts_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_SCORE_RANKS_H_
