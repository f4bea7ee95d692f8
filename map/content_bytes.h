// The memory that a map takes: its content, and what the store keeps for each of its layers.
#ifndef HYPERMAP_MAP_CONTENT_BYTES_H_
#define HYPERMAP_MAP_CONTENT_BYTES_H_

#include <cstdint>

#include "map/snapshot.h"

namespace hypermap {

// Bytes of memory of all layers (Layer::ByteSize, and a constant for each) and frames. Linear in
// the layers and frames.
int64_t ContentBytes(const Snapshot& snapshot);

// Returns ContentBytes(after) - ContentBytes(before). Linear in the layers; cheap for frames that
// the two share.
int64_t ContentGrowth(const Snapshot& before, const Snapshot& after);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_CONTENT_BYTES_H_
