#include "map/fusion/score_ranks.h"

#include <algorithm>

namespace hypermap::fusion {
namespace {

// Number of imaginary scores, evenly spread, that the histogram starts with. Without them the rank
// of the first detections would be arbitrary.
constexpr double kAssumed = 16.0;

size_t Bin(double score) {
  return std::min(ScoreRanks::kBins - 1,
                  static_cast<size_t>(std::max(0.0, score) * ScoreRanks::kBins));
}

}  // namespace

ScoreRanks::ScoreRanks() { counts_.fill(kAssumed / static_cast<double>(kBins)); }

void ScoreRanks::Add(double score) { counts_[Bin(score)] += 1.0; }

double ScoreRanks::Rank(double score) const {
  const size_t bin = Bin(score);
  double lower = 0.5 * counts_[bin];
  double all = 0.0;
  for (size_t i = 0; i < kBins; ++i) {
    if (i < bin) lower += counts_[i];
    all += counts_[i];
  }
  return lower / all;
}

}  // namespace hypermap::fusion
