// Several masks of one thing in one frame.
#ifndef HYPERMAP_INGEST_PERCEPTION_SUPPRESSION_H_
#define HYPERMAP_INGEST_PERCEPTION_SUPPRESSION_H_

#include <vector>

#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// The highest of the instance's scores.
double BestScore(const Instance& instance);

// Non-maximum suppression: of two masks with an intersection over union above 0.5, or of one of the
// same class that lies in the other by more than 0.8, the one with the lower best score is dropped,
// and its classes become alternatives of the other's. Indices of those that stay, ascending; their
// scores (those of others are left as they are) in `scores`.
struct Suppressed {
  std::vector<int> kept;
  std::vector<std::map<std::string, double>> scores;  // parallel to `kept`
};
Suppressed SuppressDuplicates(const Frame& frame);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_SUPPRESSION_H_
