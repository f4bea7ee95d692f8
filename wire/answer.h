// Answers to queries on the wire.
#ifndef HYPERMAP_WIRE_ANSWER_H_
#define HYPERMAP_WIRE_ANSWER_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "hypermap/v1/query_service.pb.h"
#include "map/query/answers.h"
#include "map/query/query.h"

namespace hypermap::wire {

v1::AnswerStatus EncodeAnswerStatus(AnswerStatus status);
absl::StatusOr<AnswerStatus> DecodeAnswerStatus(absl::string_view field, v1::AnswerStatus status);

// `geometry` is in the caller's frame.
void EncodeCellRuns(const GridGeometry& geometry, absl::Span<const CellRun> runs,
                    v1::CellRuns* message);
struct CellRuns {
  GridGeometry grid;
  std::vector<CellRun> runs;
};
absl::StatusOr<CellRuns> DecodeCellRuns(absl::string_view field, const v1::CellRuns& message);

void EncodeLayerContent(const Layer& layer, const PlanarTransform& caller_from_layer,
                        const PointContent& content, v1::LayerContent* message);

// INVALID_ARGUMENT names the field that is missing or invalid, also in the functions below.
absl::StatusOr<answers::PointAnswer> DecodePointAnswer(const v1::QueryPointResponse& message);

// Encodes the part's runs, and its objects from `first_object` on, until the message has grown to
// `max_bytes`; it contains at least one object. Returns the index of the first object that is left,
// or the number of objects.
size_t EncodeLayerPart(const LayerAnswerPart& part, size_t first_object, int64_t max_bytes,
                       v1::LayerPart* message);
absl::StatusOr<answers::LayerPart> DecodeLayerPart(const v1::LayerPart& message);

// Sets the matches and the refusals.
void EncodeNearestAnswer(const NearestNeighbours& answer, v1::QueryNearestResponse* message);
absl::StatusOr<answers::NearestAnswer> DecodeNearestAnswer(const v1::QueryNearestResponse& message);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_ANSWER_H_
