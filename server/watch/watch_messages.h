// Encoding of Watch's messages as bytes that any number of calls can write.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_
#define HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_

#include <grpcpp/support/slice.h>

#include <vector>

#include "hypermap/v1/watch_service.pb.h"
#include "server/session/change_feed.h"

namespace hypermap::server {

// A message with the commit's revision, time and author, and no changes.
v1::WatchResponse MessageOf(const FeedCommit& commit);

// One message that contains the encoded `messages` in WatchResponse.coalesced. A single message is
// returned as it is; no messages give an empty slice.
grpc::Slice Coalesce(const std::vector<grpc::Slice>& messages);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_
