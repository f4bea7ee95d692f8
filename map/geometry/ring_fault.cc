#include "map/geometry/ring_fault.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "absl/types/span.h"
#include "base/cancellation/cancellable_sort.h"
#include "base/cancellation/cancellation.h"
#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

// The order in which the sweep line reaches points: upward, and points of one height from the left.
bool IsReachedBefore(const Point& a, const Point& b) {
  return a.y < b.y || (a.y == b.y && a.x < b.x);
}

// An edge of a ring. The sweep line reaches `lower` before `upper`.
struct Edge {
  Point lower, upper;
  int32_t ring;
  bool runs_upward;  // The ring runs from `lower` to `upper`.
};

// Returns 1 if `p` is to the left of the edge, -1 if it is to the right, and 0 if it is on its
// line.
int SideOf(const Edge& edge, const Point& p) { return Orientation(edge.lower, edge.upper, p); }

// Returns the side of `a` on which `b` runs, from where it begins on `a` if it does; 0 if the two
// are on one line. REQUIRES: the sweep line has reached `a` when it reaches `b`.
int SideOf(const Edge& a, const Edge& b) {
  const int side = SideOf(a, b.lower);
  return side != 0 ? side : SideOf(a, b.upper);
}

// The order from left to right of the edges that the sweep line meets, and of points on it.
struct FromLeftToRight {
  using is_transparent = void;
  bool operator()(const Edge* a, const Edge* b) const {
    return IsReachedBefore(b->lower, a->lower) ? SideOf(*b, *a) > 0 : SideOf(*a, *b) < 0;
  }
  bool operator()(const Edge* edge, const Point& p) const { return SideOf(*edge, p) < 0; }
  bool operator()(const Point& p, const Edge* edge) const { return SideOf(*edge, p) > 0; }
};

// Returns whether the edges cross at a point that is an end of neither.
bool CrossInside(const Edge& a, const Edge& b) {
  return SideOf(a, b.lower) * SideOf(a, b.upper) < 0 && SideOf(b, a.lower) * SideOf(b, a.upper) < 0;
}

// Returns about the point in which edges that cross do so.
Point Crossing(const Edge& a, const Edge& b) {
  const double ax = a.upper.x - a.lower.x, ay = a.upper.y - a.lower.y;
  const double bx = b.upper.x - b.lower.x, by = b.upper.y - b.lower.y;
  const double along =
      ((b.lower.x - a.lower.x) * by - (b.lower.y - a.lower.y) * bx) / (ax * by - ay * bx);
  // Edges that are parallel but for rounding have no quotient of use.
  const double t = along >= 0.0 ? std::min(along, 1.0) : 0.0;
  return {a.lower.x + t * ax, a.lower.y + t * ay};
}

// Moves a line upward over the rings and keeps the edges that it meets in their order from left to
// right (Shamos and Hoey, "Geometric intersection problems", 1976). Edges that cross are
// neighbours in this order at some time before they do, so that only neighbours are compared.
// Rings may touch: at each vertex, all edges that end, begin or pass there are looked at together.
// The order decides as well which ring encloses another one.
class Sweep {
 public:
  explicit Sweep(const Rings& rings);
  std::optional<RingFault> Run();

 private:
  static constexpr int32_t kNone = -1;
  // Number of places after which the sweep looks whether it is cancelled.
  static constexpr int kVerticesPerLook = 1024;
  using MetEdges = std::set<const Edge*, FromLeftToRight>;

  struct Vertex {
    Point at;
    int32_t ring;
    // Indices of the edges that lead to the vertex and away from it.
    int32_t edge_before, edge_after;
  };

  struct RingState {
    bool is_reached = false;
    // True if the interior is on the right of the edges that run upward.
    bool interior_is_right = false;
    // The innermost ring around this one.
    int32_t enclosing = kNone;
    // True if one of its two edges at the point in question has been passed on the way round.
    bool is_open = false;
    // Parent in the forest of rings that are connected by touching.
    int32_t parent = kNone;
  };

  std::optional<RingFault> Visit(absl::Span<const Vertex> vertices);
  std::optional<RingFault> CheckOnePassage(absl::Span<const Vertex> vertices, const Edge* passing);
  std::optional<RingFault> SortAbove(const Point& p);
  std::optional<RingFault> CheckTouches(const Point& p);
  std::optional<RingFault> Advance(MetEdges::iterator begin, MetEdges::iterator end,
                                   const Edge* passing);
  std::optional<RingFault> CheckNeighbours(const Edge* a, const Edge* b) const;
  void Enter(const Edge& leftmost, const Edge* left);
  void Join(int32_t a, int32_t b, const Point& p);
  int32_t RootOf(int32_t ring);
  static RingFault CrossingAt(const Edge& a, const Edge& b, const Point& p);

  std::vector<Edge> edges_;
  std::vector<Vertex> vertices_;
  std::vector<RingState> rings_;
  // The edges that the sweep line meets.
  MetEdges met_;
  // The edges that end or pass at the current point, and those that begin or pass there, each from
  // left to right.
  std::vector<const Edge*> below_, above_;
  std::vector<int32_t> open_rings_;
  // Faults that count only if no rings cross.
  std::optional<RingFault> misplaced_, disconnected_;
};

Sweep::Sweep(const Rings& rings) : rings_(rings.size()) {
  size_t num_vertices = 0;
  for (const Ring& ring : rings) num_vertices += ring.size();
  edges_.reserve(num_vertices);
  vertices_.reserve(num_vertices);
  for (size_t r = 0; r < rings.size(); ++r) {
    const int32_t ring = static_cast<int32_t>(r);
    const int32_t first = static_cast<int32_t>(edges_.size());
    int32_t before = first + static_cast<int32_t>(rings[r].size()) - 1;
    for (size_t i = 0; i < rings[r].size(); ++i) {
      const Point& a = rings[r][i];
      const Point& b = rings[r][i + 1 < rings[r].size() ? i + 1 : 0];
      const int32_t after = first + static_cast<int32_t>(i);
      vertices_.push_back({a, ring, before, after});
      const bool runs_upward = IsReachedBefore(a, b);
      edges_.push_back({runs_upward ? a : b, runs_upward ? b : a, ring, runs_upward});
      before = after;
    }
    rings_[r].parent = ring;
  }
  CancellableSort(vertices_.begin(), vertices_.end(), [](const Vertex& a, const Vertex& b) {
    return a.at == b.at ? a.ring < b.ring : IsReachedBefore(a.at, b.at);
  });
}

std::optional<RingFault> Sweep::Run() {
  // The vertices are not sorted then.
  if (IsCancelled()) return std::nullopt;
  int until_look = kVerticesPerLook;
  for (auto it = vertices_.begin(); it != vertices_.end();) {
    const auto first = it;
    while (it != vertices_.end() && it->at == first->at) ++it;
    const size_t num_vertices = it - first;
    if (auto fault = Visit({&*first, num_vertices})) return fault;
    if (--until_look == 0) {
      if (IsCancelled()) return std::nullopt;
      until_look = kVerticesPerLook;
    }
  }
  return misplaced_.has_value() ? misplaced_ : disconnected_;
}

// Moves the sweep line over the point at which `vertices` are.
std::optional<RingFault> Sweep::Visit(absl::Span<const Vertex> vertices) {
  const Point& p = vertices.front().at;
  const auto [begin, end] = met_.equal_range(p);
  below_.assign(begin, end);
  above_.clear();
  std::copy_if(begin, end, std::back_inserter(above_),
               [&p](const Edge* edge) { return edge->upper != p; });
  if (above_.size() > 1) return CrossingAt(*above_[0], *above_[1], p);
  const Edge* const passing = above_.empty() ? nullptr : above_.front();
  if (auto fault = CheckOnePassage(vertices, passing)) return fault;
  for (const Vertex& vertex : vertices) {
    const Edge& before = edges_[vertex.edge_before];
    const Edge& after = edges_[vertex.edge_after];
    if (!before.runs_upward) above_.push_back(&before);
    if (after.runs_upward) above_.push_back(&after);
  }
  if (auto fault = SortAbove(p)) return fault;
  if (auto fault = CheckTouches(p)) return fault;
  return Advance(begin, end, passing);
}

// Finds edges that overlap from `p` on.
std::optional<RingFault> Sweep::SortAbove(const Point& p) {
  std::sort(above_.begin(), above_.end(),
            [](const Edge* a, const Edge* b) { return SideOf(*a, b->upper) < 0; });
  for (size_t i = 1; i < above_.size(); ++i) {
    if (SideOf(*above_[i - 1], above_[i]->upper) == 0) {
      return CrossingAt(*above_[i - 1], *above_[i], p);
    }
  }
  return std::nullopt;
}

// Replaces [begin, end), the edges `below_`, by the edges `above_`. Only `passing` is in both.
std::optional<RingFault> Sweep::Advance(MetEdges::iterator begin, MetEdges::iterator end,
                                        const Edge* passing) {
  for (auto it = begin; it != end;) it = *it == passing ? std::next(it) : met_.erase(it);
  auto first = end;
  for (auto it = above_.rbegin(); it != above_.rend(); ++it) {
    first = *it == passing ? std::prev(first) : met_.insert(first, *it);
  }
  const Edge* const left = first == met_.begin() ? nullptr : *std::prev(first);
  const Edge* const right = end == met_.end() ? nullptr : *end;
  for (size_t i = 0; i < above_.size(); ++i) {
    if (!rings_[above_[i]->ring].is_reached) Enter(*above_[i], i == 0 ? left : above_[i - 1]);
  }
  if (above_.empty()) return CheckNeighbours(left, right);
  if (auto fault = CheckNeighbours(left, above_.front())) return fault;
  return CheckNeighbours(above_.back(), right);
}

// Finds a ring that passes through a point twice. Vertices are sorted by their rings.
std::optional<RingFault> Sweep::CheckOnePassage(absl::Span<const Vertex> vertices,
                                                const Edge* passing) {
  for (size_t i = 0; i < vertices.size(); ++i) {
    const int32_t ring = vertices[i].ring;
    if ((i > 0 && vertices[i - 1].ring == ring) || (passing != nullptr && passing->ring == ring)) {
      const size_t index = static_cast<size_t>(ring);
      return RingFault{RingFault::Kind::kTouchesItself, index, index, vertices[i].at};
    }
  }
  return std::nullopt;
}

// Finds rings that cross at `p`, and notes those that touch. Each ring there has two edges. On the
// way round the point, rings that do not cross open and close like brackets.
std::optional<RingFault> Sweep::CheckTouches(const Point& p) {
  if (below_.size() + above_.size() == 2) return std::nullopt;
  open_rings_.clear();
  int32_t first = kNone;
  std::optional<RingFault> fault;
  const auto pass = [&](const Edge* edge) {
    RingState& ring = rings_[edge->ring];
    if (ring.is_open && open_rings_.back() != edge->ring) {
      const auto [low, high] = std::minmax(open_rings_.back(), edge->ring);
      fault = RingFault{RingFault::Kind::kCrosses, static_cast<size_t>(high),
                        static_cast<size_t>(low), p};
      return;
    }
    if (ring.is_open) {
      open_rings_.pop_back();
    } else {
      open_rings_.push_back(edge->ring);
      if (first == kNone) first = edge->ring;
      Join(first, edge->ring, p);
    }
    ring.is_open = !ring.is_open;
  };
  for (size_t i = 0; i < below_.size() && !fault.has_value(); ++i) pass(below_[i]);
  for (size_t i = above_.size(); i-- > 0 && !fault.has_value();) pass(above_[i]);
  for (const int32_t ring : open_rings_) rings_[ring].is_open = false;
  return fault;
}

std::optional<RingFault> Sweep::CheckNeighbours(const Edge* a, const Edge* b) const {
  if (a == nullptr || b == nullptr || !CrossInside(*a, *b)) return std::nullopt;
  return CrossingAt(*a, *b, Crossing(*a, *b));
}

// Notes which ring encloses the one of `leftmost`, whose lowest vertex was reached. `left` is the
// next edge on the left.
void Sweep::Enter(const Edge& leftmost, const Edge* left) {
  RingState& ring = rings_[leftmost.ring];
  ring.is_reached = true;
  ring.interior_is_right = leftmost.runs_upward;
  if (left != nullptr) {
    const RingState& beside = rings_[left->ring];
    const bool is_inside = left->runs_upward == beside.interior_is_right;
    ring.enclosing = is_inside ? left->ring : beside.enclosing;
  }
  if (leftmost.ring == 0 || ring.enclosing == 0 || misplaced_.has_value()) return;
  const size_t index = static_cast<size_t>(leftmost.ring);
  if (ring.enclosing == kNone) {
    misplaced_ = RingFault{RingFault::Kind::kLiesOutside, index, index, leftmost.lower};
  } else {
    misplaced_ = RingFault{RingFault::Kind::kIsNested, index, static_cast<size_t>(ring.enclosing),
                           leftmost.lower};
  }
}

// Notes that two rings touch. Rings that are connected already then enclose a part of the interior.
void Sweep::Join(int32_t a, int32_t b, const Point& p) {
  if (a == b) return;
  const int32_t root_a = RootOf(a), root_b = RootOf(b);
  if (root_a != root_b) {
    rings_[root_a].parent = root_b;
  } else if (!disconnected_.has_value()) {
    const auto [low, high] = std::minmax(a, b);
    disconnected_ = RingFault{RingFault::Kind::kDisconnects, static_cast<size_t>(high),
                              static_cast<size_t>(low), p};
  }
}

int32_t Sweep::RootOf(int32_t ring) {
  while (rings_[ring].parent != ring) {
    // Halving the path keeps the forest flat.
    rings_[ring].parent = rings_[rings_[ring].parent].parent;
    ring = rings_[ring].parent;
  }
  return ring;
}

RingFault Sweep::CrossingAt(const Edge& a, const Edge& b, const Point& p) {
  const auto [low, high] = std::minmax(a.ring, b.ring);
  return {low == high ? RingFault::Kind::kCrossesItself : RingFault::Kind::kCrosses,
          static_cast<size_t>(high), static_cast<size_t>(low), p};
}

}  // namespace

std::optional<RingFault> FindRingFault(const Rings& rings) { return Sweep(rings).Run(); }

}  // namespace hypermap
