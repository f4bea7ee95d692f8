// Converts answers computed in this process to the answers of a client.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_LOCAL_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_LOCAL_ANSWERS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "client_libs/cpp/answers.h"
#include "client_libs/cpp/points_stream.h"
#include "client_libs/cpp/readers.h"
#include "map/query/query.h"

namespace hypermap::client {

LayerContent ToContent(const Layer& layer, const PlanarTransform& caller_from_layer,
                       const PointContent& content);

// `contents` are the answers to `num_points` points at `snapshot`, which owns the labels.
// `incarnation` is that of the map, here and below.
PointsAnswer ToPointsAnswer(SnapshotPtr snapshot, uint64_t incarnation, size_t num_points,
                            absl::Span<const LayerPointsContent> contents);

// Converts matches and refusals only.
NearestAnswer ToNearestAnswer(const NearestNeighbours& answer);

// Returns the parts in the form in which a server sends them.
AnswerReader ReadLocally(std::unique_ptr<PartReader> parts, Revision revision,
                         uint64_t incarnation);
// Returns a reader without parts whose status is `why`, which is not OK.
AnswerReader FailLocally(absl::Status why);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_LOCAL_ANSWERS_H_
