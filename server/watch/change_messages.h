// Encoding of changes in messages of bounded size.
#ifndef HYPERMAP_SERVER_WATCH_CHANGE_MESSAGES_H_
#define HYPERMAP_SERVER_WATCH_CHANGE_MESSAGES_H_

#include <cstddef>
#include <vector>

#include "google/protobuf/repeated_ptr_field.h"
#include "hypermap/v1/watch_service.pb.h"
#include "map/watch/map_change.h"
#include "server/rpc/facilities.h"

namespace hypermap::server {

// Encodes the changes from index `first` on, until they reach limits.chunk_items objects and runs
// of cells or limits.max_chunk_bytes, but at least one. Returns the index of the first change that
// was left over, or changes.size().
size_t EncodeChanges(const std::vector<MapChange>& changes, size_t first,
                     const ServiceLimits& limits,
                     google::protobuf::RepeatedPtrField<v1::Change>* messages);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_WATCH_CHANGE_MESSAGES_H_
