#include "server/watch/change_messages.h"

#include <cstdint>

#include "wire/change.h"

namespace hypermap::server {

size_t EncodeChanges(const std::vector<MapChange>& changes, size_t first,
                     const ServiceLimits& limits,
                     google::protobuf::RepeatedPtrField<v1::Change>* messages) {
  int64_t items = 0;
  int64_t bytes = 0;
  size_t next = first;
  for (; next < changes.size(); ++next) {
    if (items >= limits.chunk_items || bytes >= limits.max_chunk_bytes) break;
    v1::Change* const message = messages->Add();
    wire::EncodeChange(changes[next], message);
    items += 1 + static_cast<int64_t>(changes[next].cells.size());
    bytes += static_cast<int64_t>(message->ByteSizeLong());
  }
  return next;
}

}  // namespace hypermap::server
