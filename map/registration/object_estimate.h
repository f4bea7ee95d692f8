// Estimates the transform between two semantic layers.
#ifndef HYPERMAP_MAP_REGISTRATION_OBJECT_ESTIMATE_H_
#define HYPERMAP_MAP_REGISTRATION_OBJECT_ESTIMATE_H_

#include "absl/status/statusor.h"
#include "map/layers/semantic_layer.h"
#include "map/registration/transform_estimate.h"

namespace hypermap::registration {

// Objects that a layer may have, and pairs of objects that may be the same.
inline constexpr int64_t kMaxRegisteredObjects = 20'000;
inline constexpr int64_t kMaxCorrespondences = 200'000;

// Returns the transform from the frame of `source` to that of `target` at which the most objects of
// the source lie on objects of the target with the same label and about the same size. Each object
// is the same as at most one other. The positions of objects are uncertain by some centimetres and
// a tenth of their size.
//
// FAILED_PRECONDITION if no two objects may be the same, RESOURCE_EXHAUSTED for more than
// kMaxRegisteredObjects or kMaxCorrespondences, errors of CheckCancelled and TakeMemory.
absl::StatusOr<TransformEstimate> EstimateFromObjects(const SemanticLayer& source,
                                                      const SemanticLayer& target);

}  // namespace hypermap::registration

#endif  // HYPERMAP_MAP_REGISTRATION_OBJECT_ESTIMATE_H_
