// What a score is worth among those of its detector.
#ifndef HYPERMAP_MAP_FUSION_SCORE_RANKS_H_
#define HYPERMAP_MAP_FUSION_SCORE_RANKS_H_

#include <array>
#include <cstddef>

namespace hypermap::fusion {

// Counts the scores met so far. Detectors differ in what they call 0.6, but all of them rank their
// better detections higher: evidence goes by the rank. A value.
class ScoreRanks {
 public:
  static constexpr size_t kBins = 256;
  using Counts = std::array<double, kBins>;

  // Before any score: as if a few had been met, evenly spread over [0, 1].
  ScoreRanks();
  explicit ScoreRanks(const Counts& counts) : counts_(counts) {}

  // `score` in [0, 1].
  void Add(double score);

  // Share of the scores that are lower, those alike counted half; in (0, 1).
  double Rank(double score) const;

  const Counts& counts() const { return counts_; }

 private:
  Counts counts_;
};

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_SCORE_RANKS_H_
