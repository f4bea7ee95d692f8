#include "map/exploration/viewshed.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Calls visit(cell) for the cells on the line between the centres of `a` and `b`, in order from
// `a`, including both, until it returns false. At a corner, it visits both cells beside the corner.
template <typename Visit>
bool WalkLine(const CellIndex& a, const CellIndex& b, Visit visit) {
  const int64_t rows = std::abs(int64_t{b.row} - a.row);
  const int64_t cols = std::abs(int64_t{b.col} - a.col);
  const int32_t row_step = b.row > a.row ? 1 : -1;
  const int32_t col_step = b.col > a.col ? 1 : -1;
  CellIndex cell = a;
  if (!visit(cell)) return false;
  // The line leaves the cell through its next row border at (2 i + 1) / (2 rows) of its length, and
  // through its next column border at (2 j + 1) / (2 cols). Integers decide exactly which is first.
  for (int64_t i = 0, j = 0; i < rows || j < cols;) {
    const int64_t by_row = (2 * i + 1) * cols;
    const int64_t by_col = (2 * j + 1) * rows;
    if (by_row == by_col) {
      if (!visit(CellIndex{cell.row + row_step, cell.col})) return false;
      if (!visit(CellIndex{cell.row, cell.col + col_step})) return false;
    }
    if (by_row <= by_col) cell.row += row_step, ++i;
    if (by_col <= by_row) cell.col += col_step, ++j;
    if (!visit(cell)) return false;
  }
  return true;
}

// Builds the prefix tree of the rays.
class RayTree {
 public:
  explicit RayTree(int32_t range) {
    // About as many nodes as the rays have: 2.2 to 2.5 for each cell of the square around them.
    nodes_.reserve(size_t{10} * range * range);
    nodes_.emplace_back();
  }

  size_t num_nodes() const { return nodes_.size(); }

  // Adds the ray from (0, 0) to `end`, up to the first cell whose centre is not nearer than
  // `range`.
  void Add(const CellIndex& end, int32_t range) {
    uint32_t node = 0;
    WalkLine({0, 0}, end, [&](const CellIndex& cell) {
      if (int64_t{cell.row} * cell.row + int64_t{cell.col} * cell.col >= int64_t{range} * range) {
        return false;
      }
      if (cell != CellIndex{0, 0}) node = ChildOf(node, cell);
      return true;
    });
  }

  // Walks the tree in depth-first order. Calls enter(cell) at each node, and leave(result of enter)
  // after the node's subtree.
  template <typename Enter, typename Leave>
  void Walk(Enter enter, Leave leave, uint32_t node = 0) const {
    const auto entered = enter(nodes_[node].cell);
    for (uint32_t child = nodes_[node].first_child; child != 0; child = nodes_[child].next) {
      Walk(enter, leave, child);
    }
    leave(entered);
  }

 private:
  // 0, the root, stands for none: it is no child.
  struct Node {
    CellIndex cell;
    uint32_t first_child = 0;
    uint32_t next = 0;  // The next child of the same node.
  };

  uint32_t ChildOf(uint32_t node, const CellIndex& cell) {
    uint32_t* link = &nodes_[node].first_child;
    while (*link != 0) {
      if (nodes_[*link].cell == cell) return *link;
      link = &nodes_[*link].next;
    }
    const auto child = static_cast<uint32_t>(nodes_.size());
    *link = child;
    nodes_.push_back({cell});
    return child;
  }

  std::vector<Node> nodes_;
};

}  // namespace

bool HasLineOfSight(const FloorPlan& plan, const CellIndex& a, const CellIndex& b) {
  return WalkLine(a, b, [&](const CellIndex& cell) { return plan.at(cell) == Floor::kFree; });
}

ViewshedRays::ViewshedRays(int32_t range) : range_(range), seen_(size_t{2} * range * 2 * range, 0) {
  RayTree rays(range);
  for (int32_t i = -range; i <= range && !IsCancelled(); ++i) {
    for (const int32_t rim : {-range, range}) {
      rays.Add({i, rim}, range);
      rays.Add({rim, i}, range);
    }
  }
  steps_.reserve(rays.num_nodes());
  rays.Walk(
      [this](const CellIndex& cell) {
        steps_.push_back({cell.row, cell.col, 0});
        return steps_.size() - 1;
      },
      [this](size_t step) { steps_[step].skip = static_cast<int32_t>(steps_.size()); });
}

void ViewshedRays::ForEachVisible(const FloorPlan& plan, const CellIndex& from,
                                  absl::FunctionRef<void(const CellIndex&)> visit) {
  // The counter wrapped around: old marks could look like new ones.
  if (++viewshed_ == 0) {
    std::fill(seen_.begin(), seen_.end(), 0);
    viewshed_ = 1;
  }
  const size_t side = size_t{2} * range_;
  for (size_t i = 0; i < steps_.size();) {
    const Step& step = steps_[i];
    const CellIndex cell{from.row + step.row, from.col + step.col};
    if (plan.at(cell) != Floor::kFree) {
      i = step.skip;
      continue;
    }
    uint32_t& seen = seen_[(step.row + range_) * side + (step.col + range_)];
    if (seen != viewshed_) visit(cell);
    seen = viewshed_;
    ++i;
  }
}

}  // namespace hypermap
