// A static R-tree of boxes.
#ifndef HYPERMAP_MAP_OBJECTS_PACKED_RTREE_H_
#define HYPERMAP_MAP_OBJECTS_PACKED_RTREE_H_

#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"

namespace hypermap {

// Returns the position of each box's centre along a Hilbert curve through all boxes.
std::vector<uint32_t> HilbertKeys(absl::Span<const Box> boxes);

// An R-tree without free space in its nodes (Kamel and Faloutsos, "On packing R-trees", CIKM 1993).
// It keeps boxes as floats relative to their common centre, rounded outwards: 21 bytes an item.
// Results are a superset, which the caller refines. Immutable; safe to read from many threads.
class PackedRTree {
 public:
  PackedRTree() = default;
  // Indexes boxes[item] for each of `items`. Neighbours in `items` share a node and should be close
  // in space, as in the order of HilbertKeys. Empty boxes intersect nothing and are far from
  // everything.
  PackedRTree(absl::Span<const Box> boxes, std::vector<int32_t> items);

  int size() const { return static_cast<int>(items_.size()); }

  // Calls `visit` with every item whose box intersects `query`, and perhaps with some next to it,
  // in no particular order.
  void Visit(const Box& query, absl::FunctionRef<void(int)> visit) const;
  // Calls `visit` with every item.
  void VisitAll(absl::FunctionRef<void(int)> visit) const;

  // Calls `visit` with items and a lower bound of their distance to `p` in metres, in the order of
  // that bound. `visit` returns the distance up to which it wants more items.
  void VisitNearest(const Point& p, absl::FunctionRef<double(int, double)> visit) const;

 private:
  struct FloatBox {
    float min_x, min_y, max_x, max_y;
  };
  // A node, or an item on level 0; `index` counts within the level.
  struct Ref {
    int32_t level;
    int32_t index;
  };
  class NearestFirst;
  FloatBox RoundOut(const Box& box) const;
  const FloatBox& BoxOf(Ref ref) const { return boxes_[level_begin_[ref.level] + ref.index]; }
  int32_t LevelSize(int32_t level) const { return level_begin_[level + 1] - level_begin_[level]; }
  // Prefetches the boxes of a node's children.
  void PrefetchBelow(Ref ref) const;
  Ref Root() const { return {static_cast<int32_t>(level_begin_.size()) - 2, 0}; }

  Point origin_;
  double extent_m_ = 0.0;
  std::vector<int32_t> items_;
  std::vector<FloatBox> boxes_;                  // Level by level, from the items to the root.
  absl::InlinedVector<int32_t, 8> level_begin_;  // Begin of each level in boxes_, and the end.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_PACKED_RTREE_H_
