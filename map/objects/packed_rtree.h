// A static index of boxes.
#ifndef HYPERMAP_MAP_OBJECTS_PACKED_RTREE_H_
#define HYPERMAP_MAP_OBJECTS_PACKED_RTREE_H_

#include <cstdint>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/functional/function_ref.h"
#include "absl/types/span.h"
#include "map/geometry/point.h"

namespace hypermap {

// Where the centres of `boxes` lie along a Hilbert curve through all of them.
std::vector<uint32_t> HilbertKeys(absl::Span<const Box> boxes);

// An R-tree packed full (Kamel and Faloutsos, "On packing R-trees", CIKM 1993). Keeps its boxes as
// floats about their common centre, rounded outwards: 21 bytes an item, and what it finds is a
// superset that the caller refines. Immutable and safe to read from many threads.
class PackedRTree {
 public:
  PackedRTree() = default;
  // Over boxes[item] for each of `items`. Neighbours in `items` share a node: they should be
  // neighbours in space. Empty boxes meet nothing and are far from everything.
  PackedRTree(absl::Span<const Box> boxes, std::vector<int32_t> items);

  int size() const { return static_cast<int>(items_.size()); }

  // Calls `visit` with every item whose box intersects `query` and perhaps with some that lie next
  // to it, in no particular order.
  void Visit(const Box& query, absl::FunctionRef<void(int)> visit) const;
  // Calls `visit` with every item.
  void VisitAll(absl::FunctionRef<void(int)> visit) const;

  // Calls `visit` with items and a distance in metres that their boxes are not nearer to `p` than,
  // in the order of that distance. `visit` says up to which distance it wants more of them.
  void VisitNearest(const Point& p, absl::FunctionRef<double(int, double)> visit) const;

 private:
  struct FloatBox {
    float min_x, min_y, max_x, max_y;
  };
  // A node or, on level 0, an item; `index` counts within the level.
  struct Ref {
    int32_t level;
    int32_t index;
  };
  class NearestFirst;
  FloatBox RoundOut(const Box& box) const;
  const FloatBox& BoxOf(Ref ref) const { return boxes_[level_begin_[ref.level] + ref.index]; }
  int32_t LevelSize(int32_t level) const { return level_begin_[level + 1] - level_begin_[level]; }
  // Asks for the memory of the boxes below a node.
  void PrefetchBelow(Ref ref) const;
  Ref Root() const { return {static_cast<int32_t>(level_begin_.size()) - 2, 0}; }

  Point origin_;
  double extent_m_ = 0.0;
  std::vector<int32_t> items_;
  std::vector<FloatBox> boxes_;                  // of the items, then level by level; root last
  absl::InlinedVector<int32_t, 8> level_begin_;  // in boxes_; one more for the end
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBJECTS_PACKED_RTREE_H_
