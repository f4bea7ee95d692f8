// The answers of a client, made of those of the map in this process.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_LOCAL_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_LOCAL_ANSWERS_H_

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

// `points` are those asked, at `snapshot`, in which the labels live.
PointsAnswer ToPointsAnswer(SnapshotPtr snapshot, size_t num_points,
                            absl::Span<const LayerPointsContent> contents);

// Matches and refusals.
NearestAnswer ToNearestAnswer(const hypermap::NearestAnswer& answer);

// Gives the parts as a server would.
AnswerReader ReadLocally(std::unique_ptr<PartReader> parts, Revision revision);
// Gives nothing but `why`, which is not OK.
AnswerReader FailLocally(absl::Status why);

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_LOCAL_ANSWERS_H_
