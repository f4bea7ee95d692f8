// Estimates of transforms between maps on the wire.
#ifndef HYPERMAP_WIRE_REGISTRATION_H_
#define HYPERMAP_WIRE_REGISTRATION_H_

#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/registration/point_pairs.h"
#include "map/registration/transform_answer.h"

namespace hypermap::wire {

void EncodePointPairs(absl::Span<const registration::NamedPair> pairs,
                      v1::EstimateTransformRequest* message);
// RESOURCE_EXHAUSTED for more than registration::kMaxPointPairs; INVALID_ARGUMENT naming the pair
// and its field for a point that is missing or not finite, or a sigma that is negative or not
// finite.
absl::StatusOr<std::vector<registration::NamedPair>> DecodePointPairs(
    const v1::EstimateTransformRequest& message);

void EncodeTransformAnswer(const registration::TransformAnswer& answer,
                           v1::EstimateTransformResponse* message);
// INVALID_ARGUMENT names the field that is missing or invalid.
absl::StatusOr<registration::TransformAnswer> DecodeTransformAnswer(
    const v1::EstimateTransformResponse& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_REGISTRATION_H_
