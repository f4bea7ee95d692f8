// Finds the transforms on which many of the possible correspondences of two point sets agree.
#ifndef HYPERMAP_MAP_REGISTRATION_CONSENSUS_H_
#define HYPERMAP_MAP_REGISTRATION_CONSENSUS_H_

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/registration/point_pairs.h"
#include "map/registration/transform_estimate.h"

namespace hypermap::registration {

// A point of the source that may be the same as one of the target. The indexes tell which
// correspondences exclude each other: each point has at most one.
struct Correspondence {
  int source = 0;
  int target = 0;
  // The correspondence agrees with a transform if its residual is less than this.
  double tolerance_m = 0.0;
  PointPair pair;
};

// Correspondences that agree with one transform.
struct Consensus {
  RigidFit fit;
  // Sum of 1 - (residual / tolerance)^2 over them.
  double gain = 0.0;
  // Their indexes, sorted by source.
  std::vector<AgreeingPair> agreeing;
};

// Returns the best consensus, and the best one whose transform is not near it, best first; fewer if
// there are fewer. Two correspondences whose points are equally far apart in source and target give
// a hypothesis, and each of them is judged by all correspondences. All hypotheses are tried, but
// for large sets a sample of some ten thousand, evenly spread: as exact as the largest clique in
// the graph of consistent distances (Lusk et al., "CLIPPER", ICRA 2021), without reflections, which
// such a graph can't tell from rotations, and in a time that is bounded. Errors of CheckCancelled.
absl::StatusOr<std::vector<Consensus>> FindConsensus(
    absl::Span<const Correspondence> correspondences);

// Returns the estimate of the first consensus, with the second one as runner-up; scores and shares
// are those of `comparable` correspondences, which is how many could agree at most. Its ambiguity
// is kLittleAgreement without any consensus, otherwise kNone.
TransformEstimate EstimateOf(const std::vector<Consensus>& found, size_t comparable);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_CONSENSUS_H_
