// Prefetching of objects, so that the waits for the memory of many overlap. These functions affect
// speed only.
#ifndef HYPERMAP_MAP_OBJECTS_PREFETCH_H_
#define HYPERMAP_MAP_OBJECTS_PREFETCH_H_

#include <algorithm>
#include <cstddef>

#include "map/objects/semantic_object.h"

namespace hypermap {

inline void Prefetch(const void* begin, size_t bytes) {
  constexpr size_t kCacheLine = 64;
  const char* const first = static_cast<const char*>(begin);
  for (size_t i = 0; i < bytes; i += kCacheLine) __builtin_prefetch(first + i);
  __builtin_prefetch(first + bytes - 1);
}

inline void PrefetchObject(const SemanticObject& object) { Prefetch(&object, sizeof object); }

// Prefetches the shape's own members: its kind, its bounding box and the pointers to its vertices.
inline void PrefetchShape(const SemanticObject& object) { Prefetch(&object.shape, sizeof(Shape)); }

// Prefetches the first vertices of the outer ring or of the line.
inline void PrefetchVertices(const Shape& shape) {
  constexpr size_t kMostVertices = 16;
  if (shape.empty() || shape.kind() == ShapeKind::kPoint) return;
  const std::vector<Point>& vertices =
      shape.is_polygon() ? shape.polygon().outer() : shape.line_string().vertices();
  Prefetch(vertices.data(), std::min(vertices.size(), kMostVertices) * sizeof(Point));
}

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_PREFETCH_H_
