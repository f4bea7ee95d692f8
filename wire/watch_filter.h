// The part of a map that a watch or a replica selects, on the wire.
#ifndef HYPERMAP_WIRE_WATCH_FILTER_H_
#define HYPERMAP_WIRE_WATCH_FILTER_H_

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/watch_filter.h"

namespace hypermap::wire {

// Decode the layers, the frame, the area and the classes of a request. A replica gets content as
// stored. The caller looks up the map. Errors are those of DecodeScope and DecodeQuestionArea.
absl::StatusOr<WatchFilter> DecodeWatchFilter(const v1::WatchRequest& request,
                                              const Limits& limits);
absl::StatusOr<WatchFilter> DecodeWatchFilter(const v1::ReplicateRequest& request,
                                              const Limits& limits);

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_WATCH_FILTER_H_
