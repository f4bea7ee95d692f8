// The best one-to-one pairing of two sets.
#ifndef HYPERMAP_MAP_EVALUATION_PAIRING_H_
#define HYPERMAP_MAP_EVALUATION_PAIRING_H_

#include <vector>

namespace hypermap::evaluation {

// Two that may go together: `left` and `right` are indexes into the two sets.
struct Candidate {
  int left = 0;
  int right = 0;
  double gain = 0.0;  // in [0, 1]
  double cost = 0.0;  // in [0, 1000]
};

// Of the pairings in which each index stands once at most, one with the most pairs; of these the
// greatest sum of gains; of these the least sum of costs (gains and costs rounded to 1e-9). Sorted
// by left. `candidates` holds no pair twice.
std::vector<Candidate> BestPairing(const std::vector<Candidate>& candidates);

}  // namespace hypermap::evaluation

#endif  // HYPERMAP_MAP_EVALUATION_PAIRING_H_
