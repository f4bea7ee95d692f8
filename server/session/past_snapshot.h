// Views of a map at a past revision, for the queries of map/query.
//
// A view is a snapshot of an earlier revision that contains only the content that one query can
// see, read through the store's indexes. For that query and scope it gives exactly the answer that
// the map would have given then. The same code thus answers queries of the past and of the present.
// Its content is in memory for this query alone, and is charged to the query's MemoryMeter.
#ifndef HYPERMAP_SERVER_SESSION_PAST_SNAPSHOT_H_
#define HYPERMAP_SERVER_SESSION_PAST_SNAPSHOT_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "map/query/query.h"
#include "storage/history.h"

namespace hypermap::server {

// A view for ContentIn and Search: the content of the scope's layers in and near `area` (in the
// scope's frame), or all of it without an area. Errors are those of the query for its scope, and
// PastMap's.
absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope,
                                     const std::optional<Polygon>& area);

// A view with all of one layer, whatever its frame. NOT_FOUND naming the layer, and PastMap's
// errors.
absl::StatusOr<SnapshotPtr> ReadPastLayer(storage::PastMap& past, const std::string& layer);

// A view for ContentAt and PointsAsker with this tolerance, for points in `box` (in the scope's
// frame). REQUIRES: `box` is not empty.
absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope, const Box& box,
                                     double tolerance_m);

// Nearest at a past revision. Reads a growing neighbourhood of `p` until it must contain the
// answer.
absl::StatusOr<NearestNeighbours> NearestInPast(storage::PastMap& past, const Scope& scope,
                                                const Point& p, const ValueQuery& value, int k);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_PAST_SNAPSHOT_H_
