// Non-maximum suppression: removes duplicate masks of one object in a frame.
#ifndef HYPERMAP_INGEST_PERCEPTION_SUPPRESSION_H_
#define HYPERMAP_INGEST_PERCEPTION_SUPPRESSION_H_

#include <vector>

#include "ingest/perception/frame.h"

namespace hypermap::ingest {

// Returns the highest of the instance's scores; 0 without scores.
double BestScore(const Instance& instance);

struct Suppressed {
  // Indices of the remaining instances, ascending.
  std::vector<int> kept;
  // Their scores, parallel to `kept`, with the classes of their duplicates as alternatives.
  std::vector<std::map<std::string, double>> scores;
};

// Two masks are duplicates if their intersection over union is above 0.5, or if they have the same
// best class and more than 0.8 of the smaller lies in the other. The one with the lower best score
// is dropped, and each of its classes is added to the other's scores with the higher of both
// scores. Compares all pairs in the worst case.
// Breaks off, and returns anything, when the work of this thread is cancelled.
Suppressed SuppressDuplicates(const Frame& frame);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_SUPPRESSION_H_
