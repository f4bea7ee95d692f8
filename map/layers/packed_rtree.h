// A static index of boxes.
#ifndef HYPERMAP_MAP_LAYERS_PACKED_RTREE_H_
#define HYPERMAP_MAP_LAYERS_PACKED_RTREE_H_

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/geometry/point.h"

namespace hypermap {

// An R-tree over boxes 0..n-1, packed full along a Hilbert curve (Kamel and Faloutsos, "On packing
// R-trees", CIKM 1993). Built once in O(n log n); immutable and safe to read from many threads.
class PackedRTree {
 public:
  PackedRTree() = default;
  explicit PackedRTree(const std::vector<Box>& boxes);

  int size() const { return num_items_; }
  Box bounds() const { return nodes_.empty() ? Box() : nodes_.back().box; }

  // Calls `visit` with the item of every box that intersects `query`, in no particular order.
  void Visit(const Box& query, absl::FunctionRef<void(int)> visit) const;

  // Calls `visit` with items in the order of their boxes' distance from `p` until it returns false.
  // `visit` gets the item and that distance in metres.
  void VisitNearest(const Point& p, absl::FunctionRef<bool(int, double)> visit) const;

 private:
  struct Node {
    Box box;
    int32_t first;  // an item for leaves, else the first child node
    int32_t count;  // 0 for leaves
  };

  int num_items_ = 0;
  std::vector<Node> nodes_;  // leaves first, the root last
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_PACKED_RTREE_H_
