#include "map/objects/packed_rtree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

namespace hypermap {
namespace {

constexpr int32_t kFanOut = 16;
constexpr int kHilbertBits = 16;

// Returns the position of cell (x, y), both below 2^kHilbertBits, along the Hilbert curve (Hacker's
// Delight, 16-2). Two bits keep the rotation of the curve so far, which avoids branches.
uint32_t HilbertIndex(uint32_t x, uint32_t y) {
  uint32_t index = 0, flipped = 0, swapped = 0;
  for (int bit = kHilbertBits - 1; bit >= 0; --bit) {
    const uint32_t bx = ((x >> bit) & 1u) ^ flipped;
    const uint32_t by = ((y >> bit) & 1u) ^ flipped;
    const uint32_t differ = (bx ^ by) & swapped;
    const uint32_t rx = bx ^ differ, ry = by ^ differ;
    index = (index << 2) | ((3 * rx) ^ ry);
    flipped ^= rx & (ry ^ 1u);
    swapped ^= ry ^ 1u;
  }
  return index;
}

Point Centre(const Box& box) {
  return {box.min.x / 2 + box.max.x / 2, box.min.y / 2 + box.max.y / 2};
}

// Bound of all coordinates: representable as a float, and its square as a double.
constexpr double kFar_m = 1e30;

float RoundDown(double value) {
  const double near = std::clamp(value, -kFar_m, kFar_m);
  const auto rounded = static_cast<float>(near);
  // Subtracts at least one step of a float, and at most four.
  constexpr float kStep = std::numeric_limits<float>::epsilon();
  return rounded > near ? rounded - std::abs(rounded) * kStep - std::numeric_limits<float>::min()
                        : rounded;
}

float RoundUp(double value) { return -RoundDown(-value); }

}  // namespace

std::vector<uint32_t> HilbertKeys(absl::Span<const Box> boxes) {
  Box all;
  for (const Box& box : boxes) all.Extend(box);
  constexpr double kCells = (1u << kHilbertBits) - 1;
  const double width_m = all.max.x - all.min.x, height_m = all.max.y - all.min.y;
  const double per_x = width_m > 0 ? kCells / width_m : 0;
  const double per_y = height_m > 0 ? kCells / height_m : 0;
  std::vector<uint32_t> keys;
  keys.reserve(boxes.size());
  for (const Box& box : boxes) {
    if (box.empty()) {
      keys.push_back(0);
      continue;
    }
    const Point centre = Centre(box);
    const double x = std::clamp((centre.x - all.min.x) * per_x, 0.0, kCells);
    const double y = std::clamp((centre.y - all.min.y) * per_y, 0.0, kCells);
    keys.push_back(HilbertIndex(static_cast<uint32_t>(x), static_cast<uint32_t>(y)));
  }
  return keys;
}

PackedRTree::PackedRTree(absl::Span<const Box> boxes, std::vector<int32_t> items)
    : items_(std::move(items)) {
  if (items_.empty()) return;
  Box all;
  for (const int32_t item : items_) all.Extend(boxes[item]);
  if (!all.empty()) {
    origin_ = Centre(all);
    extent_m_ = std::max(all.max.x - all.min.x, all.max.y - all.min.y);
  }

  boxes_.reserve(items_.size() + items_.size() / (kFanOut - 1) + level_begin_.capacity());
  for (const int32_t item : items_) boxes_.push_back(RoundOut(boxes[item]));
  level_begin_ = {0, static_cast<int32_t>(boxes_.size())};
  while (level_begin_.back() - level_begin_[level_begin_.size() - 2] > 1) {
    const int32_t begin = level_begin_[level_begin_.size() - 2];
    const int32_t end = level_begin_.back();
    for (int32_t first = begin; first < end; first += kFanOut) {
      FloatBox parent = boxes_[first];
      for (int32_t i = first + 1; i < std::min(first + kFanOut, end); ++i) {
        parent = {std::min(parent.min_x, boxes_[i].min_x), std::min(parent.min_y, boxes_[i].min_y),
                  std::max(parent.max_x, boxes_[i].max_x), std::max(parent.max_y, boxes_[i].max_y)};
      }
      boxes_.push_back(parent);
    }
    level_begin_.push_back(static_cast<int32_t>(boxes_.size()));
  }
}

// Subtraction and rounding are monotone, so that boxes that intersect still intersect afterwards.
PackedRTree::FloatBox PackedRTree::RoundOut(const Box& box) const {
  return {RoundDown(box.min.x - origin_.x), RoundDown(box.min.y - origin_.y),
          RoundUp(box.max.x - origin_.x), RoundUp(box.max.y - origin_.y)};
}

void PackedRTree::Visit(const Box& query, absl::FunctionRef<void(int)> visit) const {
  if (items_.empty() || query.empty()) return;
  const FloatBox q = RoundOut(query);
  const auto meets = [&q](const FloatBox& b) {
    return (b.min_x <= q.max_x) & (q.min_x <= b.max_x) & (b.min_y <= q.max_y) &
           (q.min_y <= b.max_y);
  };
  absl::InlinedVector<Ref, 64> open;
  if (meets(BoxOf(Root()))) open.push_back(Root());
  while (!open.empty()) {
    const Ref ref = open.back();
    open.pop_back();
    if (ref.level == 0) {
      visit(items_[ref.index]);
      continue;
    }
    const int32_t first = ref.index * kFanOut;
    const int32_t end = std::min(first + kFanOut, LevelSize(ref.level - 1));
    for (int32_t i = first; i < end; ++i) {
      const Ref child{ref.level - 1, i};
      if (meets(BoxOf(child))) open.push_back(child);
    }
  }
}

void PackedRTree::VisitAll(absl::FunctionRef<void(int)> visit) const {
  for (const int32_t item : items_) visit(item);
}

// The frontier of a best-first search: the children of all opened nodes, nearest first. The heap
// holds only the nearest child of each node. Finding the least of sixteen numbers needs no
// branches, while a heap of all children would mispredict one for most of them.
class PackedRTree::NearestFirst {
 public:
  struct Found {
    double squared_m;
    Ref ref;
  };

  // Begins with the root. (x, y) is the query point relative to the tree's origin.
  NearestFirst(const PackedRTree& tree, double x, double y) : tree_(tree), x_(x), y_(y) {
    Add(tree.Root(), 1);
  }

  bool empty() const { return nearest_.empty(); }
  double least_squared_m() const { return nearest_.front().squared_m; }

  Found Take() {
    std::pop_heap(nearest_.begin(), nearest_.end(), std::greater<>());
    const auto [squared_m, n, place] = nearest_.back();
    nearest_.pop_back();
    const Found found{squared_m, RefOf(n, place)};
    nodes_[n].squared_m[place] = kTaken;
    PushNearest(n);
    // Prefetch for the node that is likely to be taken next.
    if (!empty()) tree_.PrefetchBelow(RefOf(nearest_.front().node, nearest_.front().place));
    return found;
  }

  // Adds the children of a node.
  void Open(Ref ref) {
    const Ref first{ref.level - 1, ref.index * kFanOut};
    if (first.level == 0) __builtin_prefetch(&tree_.items_[first.index]);
    Add(first, std::min(kFanOut, tree_.LevelSize(first.level) - first.index));
  }

 private:
  static constexpr double kTaken = std::numeric_limits<double>::infinity();

  struct Node {
    Ref first;
    std::array<double, kFanOut> squared_m;  // kTaken for children already taken.
  };
  struct Nearest {
    double squared_m;
    int32_t node;
    int32_t place;  // In the node.
    bool operator>(const Nearest& other) const { return squared_m > other.squared_m; }
  };

  Ref RefOf(int32_t node, int32_t place) const {
    const Ref& first = nodes_[node].first;
    return {first.level, first.index + place};
  }

  double SquaredDistance(const FloatBox& b) const {
    const double dx = std::max(0.0, std::max(b.min_x - x_, x_ - b.max_x));
    const double dy = std::max(0.0, std::max(b.min_y - y_, y_ - b.max_y));
    return dx * dx + dy * dy;
  }

  void Add(Ref first, int32_t size) {
    Node& node = nodes_.emplace_back();
    node.first = first;
    const FloatBox* const boxes = &tree_.BoxOf(first);
    for (int32_t i = 0; i < size; ++i) node.squared_m[i] = SquaredDistance(boxes[i]);
    for (int32_t i = size; i < kFanOut; ++i) node.squared_m[i] = kTaken;
    PushNearest(static_cast<int32_t>(nodes_.size()) - 1);
  }

  void PushNearest(int32_t n) {
    const std::array<double, kFanOut>& squared_m = nodes_[n].squared_m;
    std::array<double, kFanOut> least = squared_m;
    for (int32_t width = kFanOut / 2; width > 0; width /= 2) {
      for (int32_t i = 0; i < width; ++i) least[i] = std::min(least[i], least[i + width]);
    }
    if (least[0] == kTaken) return;
    const auto place = std::find(squared_m.begin(), squared_m.end(), least[0]) - squared_m.begin();
    nearest_.push_back({least[0], n, static_cast<int32_t>(place)});
    std::push_heap(nearest_.begin(), nearest_.end(), std::greater<>());
  }

  const PackedRTree& tree_;
  const double x_, y_;
  absl::InlinedVector<Node, 16> nodes_;
  absl::InlinedVector<Nearest, 16> nearest_;  // A heap; one entry for each node with children left.
};

void PackedRTree::VisitNearest(const Point& p, absl::FunctionRef<double(int, double)> visit) const {
  if (items_.empty()) return;
  // Clamping moves a point only towards the boxes, so that lower bounds stay lower bounds.
  const double x = std::clamp(p.x - origin_.x, -kFar_m, kFar_m);
  const double y = std::clamp(p.y - origin_.y, -kFar_m, kFar_m);
  // More than the rounding errors of the subtractions here and of the caller's exact distance.
  const double slack_m =
      64 * std::numeric_limits<double>::epsilon() * (std::abs(x) + std::abs(y) + 2 * extent_m_);
  double limit = std::numeric_limits<double>::infinity();  // Squared.
  NearestFirst search(*this, x, y);
  while (!search.empty() && search.least_squared_m() <= limit) {
    const auto [squared_m, ref] = search.Take();
    if (ref.level > 0) {
      search.Open(ref);
      continue;
    }
    const double at_least_m = std::max(0.0, std::sqrt(squared_m) - slack_m);
    const double limit_m = visit(items_[ref.index], at_least_m) + slack_m;
    limit = limit_m * limit_m * (1 + 4 * std::numeric_limits<double>::epsilon());
  }
}

void PackedRTree::PrefetchBelow(Ref ref) const {
  if (ref.level == 0) return;
  constexpr int32_t kBoxesPerLine = 64 / sizeof(FloatBox);
  const int32_t first = ref.index * kFanOut;
  const int32_t end = std::min(first + kFanOut, LevelSize(ref.level - 1));
  for (int32_t i = first; i < end; i += kBoxesPerLine) {
    __builtin_prefetch(&BoxOf({ref.level - 1, i}));
  }
}

}  // namespace hypermap
