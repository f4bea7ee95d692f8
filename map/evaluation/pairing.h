// Optimal one-to-one pairing of two sets.
#ifndef HYPERMAP_MAP_EVALUATION_PAIRING_H_
#define HYPERMAP_MAP_EVALUATION_PAIRING_H_

#include <vector>

namespace hypermap::evaluation {

// Two elements that may be paired, by their indexes in the two sets.
struct Candidate {
  int left = 0;
  int right = 0;
  double gain = 0.0;  // In [0, 1].
  double cost = 0.0;  // In [0, 1000].
};

// Returns the best pairing in which each index occurs at most once: the one with the most pairs; of
// these, the one with the greatest sum of gains; of these, the one with the least sum of costs.
// Gains and costs are rounded to 1e-9. Sorted by left. `candidates` must not contain a pair twice.
std::vector<Candidate> BestPairing(const std::vector<Candidate>& candidates);

}  // namespace hypermap::evaluation

#endif  // HYPERMAP_MAP_EVALUATION_PAIRING_H_
