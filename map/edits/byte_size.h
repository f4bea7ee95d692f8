// The memory that edits and changes take, for limits of queues and buffers.
#ifndef HYPERMAP_MAP_EDITS_BYTE_SIZE_H_
#define HYPERMAP_MAP_EDITS_BYTE_SIZE_H_

#include <cstdint>

#include "map/edits/change.h"
#include "map/edits/edit.h"

namespace hypermap {

// Bytes of memory, estimated from the sizes of strings, vertices, cells and entries. What a value
// shares with others is counted in full. ByteSize of an object is in map/objects.

int64_t ByteSize(const Polygon& polygon);
int64_t ByteSize(const Edit& edit);
int64_t ByteSize(const EditBatch& batch);

// With the content before and after the change, because it keeps both.
int64_t ByteSize(const Change& change);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_EDITS_BYTE_SIZE_H_
