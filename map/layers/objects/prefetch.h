// Asking for the memory of objects before it is needed, so that the waits of many overlap. Only a
// matter of speed.
#ifndef HYPERMAP_MAP_LAYERS_OBJECTS_PREFETCH_H_
#define HYPERMAP_MAP_LAYERS_OBJECTS_PREFETCH_H_

#include <algorithm>
#include <cstddef>

#include "map/layers/semantic_object.h"

namespace hypermap {

inline void Prefetch(const void* begin, size_t bytes) {
  constexpr size_t kCacheLine = 64;
  const char* const first = static_cast<const char*>(begin);
  for (size_t i = 0; i < bytes; i += kCacheLine) __builtin_prefetch(first + i);
  __builtin_prefetch(first + bytes - 1);
}

inline void PrefetchObject(const SemanticObject& object) { Prefetch(&object, sizeof object); }

// What leads to the rings and the bounding box.
inline void PrefetchPolygon(const SemanticObject& object) {
  Prefetch(&object.polygon, sizeof(Polygon));
}

// The beginning of the outer ring.
inline void PrefetchOuterRing(const Polygon& polygon) {
  constexpr size_t kMostVertices = 16;
  if (polygon.empty()) return;
  const Ring& ring = polygon.outer();
  Prefetch(ring.data(), std::min(ring.size(), kMostVertices) * sizeof(Point));
}

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_OBJECTS_PREFETCH_H_
