// Limits of the parts of a message.
#ifndef HYPERMAP_WIRE_LIMITS_H_
#define HYPERMAP_WIRE_LIMITS_H_

#include <cstdint>

namespace hypermap::wire {

// A message that exceeds one of these is refused with RESOURCE_EXHAUSTED, naming the server's flag.
struct DecodeLimits {
  int max_vertices = 100'000;      // In one polygon, over all its rings.
  int max_edits = 10'000;          // In one batch.
  int64_t max_cells = 16'777'216;  // Written by one edit.
};

}  // namespace hypermap::wire

#endif  // HYPERMAP_WIRE_LIMITS_H_
