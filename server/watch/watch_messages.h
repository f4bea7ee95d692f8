// Encoding of changes in messages of bounded size, and of Watch's and Replicate's messages as bytes
// that any number of calls can write.
#ifndef HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_
#define HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_

#include <grpcpp/support/slice.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/limits/limits.h"
#include "google/protobuf/repeated_ptr_field.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/map_change.h"
#include "server/rpc/facilities.h"
#include "server/session/change_feed.h"

namespace hypermap::server {

// The message that is built for both rpcs. The fields of WatchResponse have the same numbers and
// types in ReplicateResponse (a test compares them), so that the bytes of a message whose other
// fields are not set are those of a WatchResponse, too.
using WatchMessage = v1::ReplicateResponse;

// A message with the commit's revision, time and author, and the incarnation of its map, and no
// changes.
WatchMessage MessageOf(const FeedCommit& commit, uint64_t incarnation);

// Adds changes to a message, as long as it has fewer than limits.chunk_items objects and runs of
// cells and fewer bytes than limits.max_chunk_bytes.
class ChangeEncoder {
 public:
  // Both must outlive this.
  ChangeEncoder(const Limits& limits, google::protobuf::RepeatedPtrField<v1::Change>* messages)
      : limits_(limits), messages_(messages) {}

  // Returns whether the message takes no further change.
  bool full() const { return items_ >= limits_.chunk_items || bytes_ >= limits_.max_chunk_bytes; }
  // REQUIRES: !full().
  void Add(const MapChange& change);

 private:
  const Limits& limits_;
  google::protobuf::RepeatedPtrField<v1::Change>* const messages_;
  int64_t items_ = 0;
  int64_t bytes_ = 0;
};

// Encodes the changes from index `first` on, until the message is full. Returns the index of the
// first change that was left over, or changes.size().
size_t EncodeChanges(const std::vector<MapChange>& changes, size_t first, const Limits& limits,
                     google::protobuf::RepeatedPtrField<v1::Change>* messages);
// Returns whether EncodeChanges would leave changes over because of limits.chunk_items.
bool ExceedMessage(const std::vector<MapChange>& changes, const Limits& limits);

// One message that contains the encoded `messages` in its field `coalesced`. A single message is
// returned as it is; no messages give an empty slice.
grpc::Slice Coalesce(const std::vector<grpc::Slice>& messages);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_WATCH_MESSAGES_H_
