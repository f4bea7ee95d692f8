// Watch's messages as bytes, which any number of calls can write.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_
#define HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_

#include <grpcpp/support/slice.h>

#include <vector>

#include "hypermap/v1/watch_service.pb.h"
#include "server/session/change_feed.h"

namespace hypermap::server {

// The message of a commit, still without changes.
v1::WatchResponse MessageOf(const FeedCommit& commit);

// A message with the messages in WatchResponse.coalesced; one comes as it is, none is empty.
grpc::Slice Coalesce(const std::vector<grpc::Slice>& messages);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_
