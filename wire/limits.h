// How large a message's parts may be.
#ifndef HYPERMAP_WIRE_LIMITS_H_
#define HYPERMAP_WIRE_LIMITS_H_

#include <cstdint>

namespace hypermap::wire {

// Past one of these a message is refused with RESOURCE_EXHAUSTED naming the server's flag.
struct DecodeLimits {
  int max_vertices = 100'000;      // of one polygon, over all its rings
  int max_edits = 10'000;          // of one batch
  int64_t max_cells = 16'777'216;  // that one edit writes
};

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_LIMITS_H_
