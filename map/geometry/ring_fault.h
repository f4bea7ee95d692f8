// Finds the fault of rings that make no valid polygon.
#ifndef HYPERMAP_MAP_GEOMETRY_RING_FAULT_H_
#define HYPERMAP_MAP_GEOMETRY_RING_FAULT_H_

#include <cstddef>
#include <optional>

#include "map/geometry/point.h"
#include "map/geometry/polygon.h"

namespace hypermap {

struct RingFault {
  enum class Kind {
    kTouchesItself,  // The ring passes through a point twice.
    kCrossesItself,  // Two edges of the ring cross or overlap.
    kCrosses,        // The ring crosses the other one, or shares a part of an edge with it.
    kLiesOutside,    // The ring is a hole outside of the outer ring.
    kIsNested,       // The ring is a hole inside of the other one, which is a hole.
    kDisconnects,    // The interior is cut apart where the ring touches the other one.
  };
  Kind kind;
  // Indices of the rings at fault; 0 is the outer ring. `other` is less than `ring`, except that
  // either may be the larger for kIsNested, and equals `ring` if the kind names one ring only.
  size_t ring;
  size_t other;
  // A point where the rings meet, or the lowest vertex of a ring that lies in the wrong place.
  Point place;
};

// Returns a fault of the polygon that consists of an outer ring and holes, or nullopt if it is
// valid (OGC); any value if IsCancelled(). Crossings are found before holes in the wrong place, and
// these before a divided interior. Exact, and takes O(n log n) time for n vertices, valid or not.
// REQUIRES: each ring has at least 3 vertices, all of them finite, and none equals the next one of
// its ring.
std::optional<RingFault> FindRingFault(const Rings& rings);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GEOMETRY_RING_FAULT_H_
