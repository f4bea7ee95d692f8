#include "map/layers/packed_rtree.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <utility>

namespace hypermap {
namespace {

constexpr int kFanOut = 16;
constexpr int kHilbertBits = 16;

// Position of cell (x, y), both below 2^kHilbertBits, along the Hilbert curve (Hacker's Delight,
// 16-2).
uint32_t HilbertIndex(uint32_t x, uint32_t y) {
  uint32_t d = 0;
  for (uint32_t s = 1u << (kHilbertBits - 1); s > 0; s >>= 1) {
    const uint32_t rx = (x & s) ? 1 : 0;
    const uint32_t ry = (y & s) ? 1 : 0;
    d += s * s * ((3 * rx) ^ ry);
    if (ry == 0) {
      if (rx == 1) {
        x = (1u << kHilbertBits) - 1 - x;
        y = (1u << kHilbertBits) - 1 - y;
      }
      std::swap(x, y);
    }
  }
  return d;
}

uint32_t Scale(double value, double min, double max) {
  if (!(max > min)) return 0;
  return static_cast<uint32_t>((value - min) / (max - min) * ((1u << kHilbertBits) - 1));
}

std::vector<int32_t> HilbertOrder(const std::vector<Box>& boxes) {
  Box all;
  for (const Box& box : boxes) all.Extend(box);
  std::vector<uint32_t> keys;
  keys.reserve(boxes.size());
  for (const Box& box : boxes) {
    const double x = box.min.x / 2 + box.max.x / 2;
    const double y = box.min.y / 2 + box.max.y / 2;
    keys.push_back(HilbertIndex(Scale(x, all.min.x, all.max.x), Scale(y, all.min.y, all.max.y)));
  }
  std::vector<int32_t> order(boxes.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&keys](int32_t a, int32_t b) {
    return std::pair(keys[a], a) < std::pair(keys[b], b);
  });
  return order;
}

}  // namespace

PackedRTree::PackedRTree(const std::vector<Box>& boxes)
    : num_items_(static_cast<int>(boxes.size())) {
  for (const int32_t item : HilbertOrder(boxes)) nodes_.push_back({boxes[item], item, 0});
  int32_t level_begin = 0;
  int32_t level_end = static_cast<int32_t>(nodes_.size());
  while (level_end - level_begin > 1) {
    for (int32_t first = level_begin; first < level_end; first += kFanOut) {
      Node parent{Box(), first, std::min(kFanOut, level_end - first)};
      for (int32_t i = 0; i < parent.count; ++i) parent.box.Extend(nodes_[first + i].box);
      nodes_.push_back(parent);
    }
    level_begin = level_end;
    level_end = static_cast<int32_t>(nodes_.size());
  }
}

void PackedRTree::Visit(const Box& query, absl::FunctionRef<void(int)> visit) const {
  if (nodes_.empty()) return;
  std::vector<int32_t> open = {static_cast<int32_t>(nodes_.size()) - 1};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!node.box.Intersects(query)) continue;
    if (node.count == 0) visit(node.first);
    for (int32_t i = 0; i < node.count; ++i) open.push_back(node.first + i);
  }
}

void PackedRTree::VisitNearest(const Point& p, absl::FunctionRef<bool(int, double)> visit) const {
  if (nodes_.empty()) return;
  using Entry = std::pair<double, int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  const auto push = [&](int32_t node) { open.emplace(Distance(nodes_[node].box, p), node); };
  push(static_cast<int32_t>(nodes_.size()) - 1);
  while (!open.empty()) {
    const auto [distance_m, index] = open.top();
    open.pop();
    const Node& node = nodes_[index];
    if (node.count == 0 && !visit(node.first, distance_m)) return;
    for (int32_t i = 0; i < node.count; ++i) push(node.first + i);
  }
}

}  // namespace hypermap
