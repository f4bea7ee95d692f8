// The messages of the ListChanges rpc.
#ifndef HYPERMAP_SERVER_WATCH_DIFFERENCE_SOURCE_H_
#define HYPERMAP_SERVER_WATCH_DIFFERENCE_SOURCE_H_

#include <memory>

#include "absl/status/statusor.h"
#include "hypermap/v1/watch_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"

namespace hypermap::server {

// Reads the commits between two revisions in bounded steps, then sends their net difference in
// messages of bounded size. An empty difference is one message without changes. Errors are those of
// the rpc (proto/hypermap/v1/watch_service.proto).
absl::StatusOr<std::unique_ptr<MessageSource<v1::ListChangesResponse>>> OpenDifference(
    const Facilities& facilities, const v1::ListChangesRequest& request);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_DIFFERENCE_SOURCE_H_
