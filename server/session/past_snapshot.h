// Views of a map as it was, for the ordinary questions of map/query.
//
// A view is a snapshot of an earlier revision with no more content than a question can see, read
// through the store's indexes. Asked that question in that scope, it answers exactly what the map
// would have answered then.
#ifndef HYPERMAP_SERVER_SESSION_PAST_SNAPSHOT_H_
#define HYPERMAP_SERVER_SESSION_PAST_SNAPSHOT_H_

#include <optional>

#include "absl/status/statusor.h"
#include "map/query/query.h"
#include "storage/history.h"

namespace hypermap::server {

// For ContentIn, and for Search with an area: the content of the scope's layers near `area` (in the
// scope's frame). Without an area: all of it. Errors are those of the question for its scope, and
// PastMap's.
absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope,
                                     const std::optional<Polygon>& area);

// For ContentAt and PointsAsker with this tolerance, asked of points in `box`, which is not empty
// (the scope's frame).
absl::StatusOr<SnapshotPtr> ReadPast(storage::PastMap& past, const Scope& scope, const Box& box,
                                     double tolerance_m);

// Nearest, asked of the past: reads a growing neighbourhood until the answer lies within it.
absl::StatusOr<NearestAnswer> NearestInPast(storage::PastMap& past, const Scope& scope,
                                            const Point& p, const ValueQuery& value, int k);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_PAST_SNAPSHOT_H_
