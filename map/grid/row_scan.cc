#include "map/grid/row_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "map/geometry/predicates.h"

namespace hypermap {
namespace {

// The arithmetic that Lattice promises; equals that of GridGeometry without rotation.
double Position(double origin, int32_t index, double offset, double step) {
  return origin + (index + offset) * step;
}

// The columns at which a row enters or leaves the polygon.
using Crossings = absl::InlinedVector<int32_t, 8>;

// Appends the spans of the columns that have an odd number of crossings at or left of them.
void AppendInside(Crossings crossings, ColumnSpans& spans) {
  std::sort(crossings.begin(), crossings.end());
  for (size_t i = 0; i + 1 < crossings.size(); i += 2) {
    if (crossings[i] < crossings[i + 1]) spans.push_back({crossings[i], crossings[i + 1]});
  }
}

}  // namespace

class RowScan::Place {
 public:
  static Place AtHeight(const Edge& edge, double y) {
    // A vertical edge has the same x at all heights.
    if (y <= edge.low.y || edge.low.x == edge.high.x) return Place(edge.low);
    if (y >= edge.high.y) return Place(edge.high);
    return Place(edge.low, edge.high, y);
  }

  // Returns the leftmost and the rightmost point of the edge between two heights.
  static std::pair<Place, Place> Ends(const Edge& edge, double y_min, double y_max) {
    Place lower = AtHeight(edge, y_min), upper = AtHeight(edge, y_max);
    // A horizontal edge has no lower end.
    if (edge.low.y == edge.high.y) lower = Place(edge.low), upper = Place(edge.high);
    if (edge.low.x > edge.high.x) std::swap(lower, upper);
    return {lower, upper};
  }

  bool IsLeftOf(double x) const {
    return is_vertex_ ? low_.x < x : Orientation(low_, high_, {x, y_}) < 0;
  }
  bool IsRightOf(double x) const {
    return is_vertex_ ? low_.x > x : Orientation(low_, high_, {x, y_}) > 0;
  }
  // Returns the place in units of columns, rounded: a start for the exact search.
  double ApproximateColumn(const Lattice& lattice, double offset) const {
    const double x =
        is_vertex_ ? low_.x : low_.x + (high_.x - low_.x) * ((y_ - low_.y) / (high_.y - low_.y));
    return (x - lattice.origin.x) / lattice.step - offset;
  }
  // Returns a generous bound of the error of ApproximateColumn: a few roundings of numbers of this
  // size.
  double ApproximationError(const Lattice& lattice, double column) const {
    constexpr double kRoundings = 16 * std::numeric_limits<double>::epsilon();
    const double x = std::abs(low_.x) + (is_vertex_ ? 0.0 : std::abs(high_.x));
    return kRoundings * ((x + std::abs(lattice.origin.x)) / lattice.step + std::abs(column));
  }

 private:
  explicit Place(const Point& vertex) : is_vertex_(true), low_(vertex) {}
  Place(const Point& low, const Point& high, double y)
      : is_vertex_(false), low_(low), high_(high), y_(y) {}

  bool is_vertex_;
  Point low_, high_;
  double y_ = 0.0;
};

RowScan::RowScan(const Polygon& polygon, int32_t col_begin, int32_t col_end)
    : col_begin_(col_begin), col_end_(std::max(col_begin, col_end)) {
  edges_.reserve(polygon.num_vertices());
  for (const Ring& ring : polygon.rings()) {
    Point a = ring.back();
    for (const Point& b : ring) {
      edges_.push_back(a.y <= b.y ? Edge{a, b, 0.0} : Edge{b, a, 0.0});
      is_rectilinear_ = is_rectilinear_ && (a.x == b.x || a.y == b.y);
      a = b;
    }
  }
  std::sort(edges_.begin(), edges_.end(),
            [](const Edge& a, const Edge& b) { return a.low.y < b.low.y; });
  BuildTree(0, static_cast<int>(edges_.size()));
}

double RowScan::BuildTree(int begin, int end) {
  if (begin == end) return -std::numeric_limits<double>::infinity();
  const int root = begin + (end - begin) / 2;
  Edge& edge = edges_[root];
  edge.subtree_max_y = std::max({edge.high.y, BuildTree(begin, root), BuildTree(root + 1, end)});
  return edge.subtree_max_y;
}

template <typename Visit>
void RowScan::VisitEdges(double y_min, double y_max, const Visit& visit) const {
  VisitSubtree(0, static_cast<int>(edges_.size()), y_min, y_max, visit);
}

template <typename Visit>
void RowScan::VisitSubtree(int begin, int end, double y_min, double y_max,
                           const Visit& visit) const {
  // A scan of a few edges is faster than descending to them.
  constexpr int kFew = 8;
  if (end - begin <= kFew) {
    for (int i = begin; i < end && edges_[i].low.y <= y_max; ++i) {
      if (edges_[i].high.y >= y_min) visit(edges_[i]);
    }
    return;
  }
  const int root = begin + (end - begin) / 2;
  const Edge& edge = edges_[root];
  if (edge.subtree_max_y < y_min) return;
  VisitSubtree(begin, root, y_min, y_max, visit);
  if (edge.low.y > y_max) return;
  if (edge.high.y >= y_min) visit(edge);
  VisitSubtree(root + 1, end, y_min, y_max, visit);
}

std::optional<int32_t> RowScan::ColumnAfter(double guess, double error) const {
  const double left = std::floor(guess);
  if (guess - left > error && left + 1 - guess > error) {
    return static_cast<int32_t>(std::clamp<double>(left + 1, col_begin_, col_end_));
  }
  return std::nullopt;
}

int32_t RowScan::FirstColumn(const Lattice& lattice, double offset, const Place& place,
                             Side side) const {
  const double guess = place.ApproximateColumn(lattice, offset);
  const auto next = ColumnAfter(guess, place.ApproximationError(lattice, guess));
  return next ? *next : FindColumn(lattice, offset, place, side, guess);
}

RowScan::FirstColumns RowScan::ColumnsFrom(const Lattice& lattice, double offset,
                                           const Place& place) const {
  const double guess = place.ApproximateColumn(lattice, offset);
  if (const auto next = ColumnAfter(guess, place.ApproximationError(lattice, guess))) {
    return {*next, *next};
  }
  return {FindColumn(lattice, offset, place, Side::kAtOrRight, guess),
          FindColumn(lattice, offset, place, Side::kRight, guess)};
}

int32_t RowScan::FindColumn(const Lattice& lattice, double offset, const Place& place, Side side,
                            double guess) const {
  const auto reached = [&](int64_t col) {
    const double x = Position(lattice.origin.x, static_cast<int32_t>(col), offset, lattice.step);
    return side == Side::kRight ? place.IsLeftOf(x) : !place.IsRightOf(x);
  };
  // Columns are sorted by x. Widen from the guess until the answer is in (low, high], then bisect.
  int64_t low = col_begin_ - 1, high = col_end_;
  if (guess > low && guess < high) {
    const int64_t middle = std::max<int64_t>(static_cast<int64_t>(guess), col_begin_);
    int64_t step = 1;
    if (reached(middle)) {
      high = middle;
      while (high - step > low && reached(high - step)) high -= step, step *= 2;
      low = std::max(low, high - step);
    } else {
      low = middle;
      while (low + step < high && !reached(low + step)) low += step, step *= 2;
      high = std::min(high, low + step);
    }
  }
  while (high - low > 1) {
    const int64_t middle = low + (high - low) / 2;
    (reached(middle) ? high : low) = middle;
  }
  return static_cast<int32_t>(high);
}

ColumnSpans RowScan::Touched(const Lattice& lattice, int32_t row) const {
  if (lattice.low == lattice.high) return TouchedPoints(lattice, row);
  const double y_min = Position(lattice.origin.y, row, lattice.low, lattice.step);
  const double y_max = Position(lattice.origin.y, row, lattice.high, lattice.step);
  ColumnSpans spans;
  Crossings crossings;
  VisitEdges(y_min, y_max, [&](const Edge& edge) {
    const auto [left, right] = Place::Ends(edge, y_min, y_max);
    spans.push_back({FirstColumn(lattice, lattice.high, left, Side::kAtOrRight),
                     FirstColumn(lattice, lattice.low, right, Side::kRight)});
    if (edge.low.y <= y_min && edge.high.y > y_min) {
      crossings.push_back(
          FirstColumn(lattice, lattice.low, Place::AtHeight(edge, y_min), Side::kAtOrRight));
    }
  });
  // A cell that no edge touches is inside if its lower left corner is. A cell whose corner is
  // inside is touched in any case.
  AppendInside(std::move(crossings), spans);
  return Union(std::move(spans));
}

// Equals Touched, but needs only one lookup per edge, as both sides of a cell are the same point.
ColumnSpans RowScan::TouchedPoints(const Lattice& lattice, int32_t row) const {
  const double y = Position(lattice.origin.y, row, lattice.low, lattice.step);
  ColumnSpans spans;
  Crossings crossings;
  VisitEdges(y, y, [&](const Edge& edge) {
    if (edge.low.y == edge.high.y) {
      const auto [left, right] = Place::Ends(edge, y, y);
      spans.push_back({FirstColumn(lattice, lattice.low, left, Side::kAtOrRight),
                       FirstColumn(lattice, lattice.low, right, Side::kRight)});
      return;
    }
    const FirstColumns columns = ColumnsFrom(lattice, lattice.low, Place::AtHeight(edge, y));
    // A point on an edge is touched, whichever side of it is inside.
    if (columns.at_or_right < columns.right) spans.push_back({columns.at_or_right, columns.right});
    if (edge.high.y > y) crossings.push_back(columns.at_or_right);
  });
  AppendInside(std::move(crossings), spans);
  return Union(std::move(spans));
}

int32_t RowScan::EndOfLikeRows(const Lattice& lattice, int32_t row) const {
  if (!is_rectilinear_) return row + 1;
  // Find the next height at which an edge begins or ends.
  const double y = Position(lattice.origin.y, row, lattice.low, lattice.step);
  double end = std::numeric_limits<double>::infinity();
  VisitEdges(y, y, [&end](const Edge& edge) { end = std::min(end, edge.high.y); });
  const auto next = std::upper_bound(edges_.begin(), edges_.end(), y,
                                     [](double y, const Edge& edge) { return y < edge.low.y; });
  if (next != edges_.end()) end = std::min(end, next->low.y);
  // Rounding may put the row just below that height on it, so that row is left out.
  const double end_row = std::floor((end - lattice.origin.y) / lattice.step - lattice.low);
  if (!(end_row > row + 1.0)) return row + 1;
  return static_cast<int32_t>(std::min<double>(end_row, std::numeric_limits<int32_t>::max()));
}

ColumnSpans RowScan::Covered(const Lattice& lattice, int32_t row) const {
  const double middle = (lattice.low + lattice.high) / 2;
  const double y_min = Position(lattice.origin.y, row, lattice.low, lattice.step);
  const double y_middle = Position(lattice.origin.y, row, middle, lattice.step);
  const double y_max = Position(lattice.origin.y, row, lattice.high, lattice.step);
  ColumnSpans inside, cut;
  Crossings crossings;
  VisitEdges(y_min, y_max, [&](const Edge& edge) {
    // One side of every edge is outside, so that cells that an edge passes through are not covered.
    if (edge.high.y > y_min && edge.low.y < y_max) {
      const auto [left, right] = Place::Ends(edge, y_min, y_max);
      cut.push_back({FirstColumn(lattice, lattice.high, left, Side::kRight),
                     FirstColumn(lattice, lattice.low, right, Side::kAtOrRight)});
    }
    if (edge.low.y <= y_middle && edge.high.y > y_middle) {
      crossings.push_back(
          FirstColumn(lattice, middle, Place::AtHeight(edge, y_middle), Side::kAtOrRight));
    }
  });
  AppendInside(std::move(crossings), inside);
  return Difference(Union(std::move(inside)), Union(std::move(cut)));
}

}  // namespace hypermap
