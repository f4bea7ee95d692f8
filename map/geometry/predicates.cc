#include "map/geometry/predicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "map/geometry/geos_context.h"

namespace hypermap {
namespace {

int Sign(double v) { return (v > 0.0) - (v < 0.0); }

// Returns the sign of the sum of `terms`, computed exactly as a nonoverlapping expansion, whose
// last non-zero component has that sign (Shewchuk, "Adaptive precision floating-point arithmetic
// and fast robust geometric predicates", 1997, figure 6).
template <typename Real, size_t kTerms>
int SignOfSum(const std::array<Real, kTerms>& terms) {
  std::array<Real, kTerms> expansion{};
  for (size_t i = 0; i < kTerms; ++i) {
    Real carry = terms[i];
    for (size_t j = 0; j < i; ++j) {
      const Real sum = carry + expansion[j];
      const Real rounded = sum - carry;
      expansion[j] = (carry - (sum - rounded)) + (expansion[j] - rounded);
      carry = sum;
    }
    expansion[i] = carry;
  }
  for (size_t i = kTerms; i-- > 0;) {
    if (expansion[i] != 0) return expansion[i] > 0 ? 1 : -1;
  }
  return 0;
}

// Evaluates the determinant as six products of coordinates, each exact as a pair of numbers.
// REQUIRES: no product of two coordinates over- or underflows.
template <typename Real>
int SignOfDeterminant(const Point& a, const Point& b, const Point& c) {
  std::array<Real, 12> terms;
  size_t n = 0;
  const auto add_product = [&](Real u, Real v) {
    const Real product = u * v;
    terms[n++] = std::fma(u, v, -product);
    terms[n++] = product;
  };
  add_product(a.x, b.y);
  add_product(-a.x, c.y);
  add_product(b.x, c.y);
  add_product(-b.x, a.y);
  add_product(c.x, a.y);
  add_product(-c.x, b.y);
  return SignOfSum(terms);
}

int ExactOrientation(const Point& a, const Point& b, const Point& c) {
  double smallest = std::numeric_limits<double>::infinity(), largest = 0.0;
  for (const double coordinate : {a.x, a.y, b.x, b.y, c.x, c.y}) {
    if (!std::isfinite(coordinate)) return 0;
    const double size = std::abs(coordinate);
    if (size != 0.0) smallest = std::min(smallest, size);
    largest = std::max(largest, size);
  }
  // With room for the rounding errors of the products.
  if (smallest >= 0x1p-400 && largest <= 0x1p400) return SignOfDeterminant<double>(a, b, c);
  // Its exponents are large enough for all products of two doubles, though it may be slow.
  using Extended = long double;
  static_assert(std::numeric_limits<Extended>::max_exponent >= 16384);
  return SignOfDeterminant<Extended>(a, b, c);
}

enum class Location { kInside, kBoundary, kOutside };

// Counts the edges that a ray from `p` to the right crosses. An edge includes its lower end but not
// its upper one, so that a ray through a vertex counts correctly.
Location Locate(const Ring& ring, const Point& p) {
  bool inside = false;
  Point a = ring.back();
  for (const Point& b : ring) {
    if ((a.y > p.y) != (b.y > p.y)) {
      const int turn = Orientation(a, b, p);
      if (turn == 0) return Location::kBoundary;
      if ((turn > 0) == (b.y > a.y)) inside = !inside;
    } else if (b.y == p.y) {
      if (b.x == p.x || (a.y == p.y && (a.x > p.x) != (b.x > p.x))) return Location::kBoundary;
    }
    a = b;
  }
  return inside ? Location::kInside : Location::kOutside;
}

double DistanceToSegment(const Point& p, const Point& a, const Point& b) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double along = (p.x - a.x) * dx + (p.y - a.y) * dy;
  const double squared = dx * dx + dy * dy;
  if (!(along > 0.0)) return std::hypot(p.x - a.x, p.y - a.y);
  if (along >= squared) return std::hypot(p.x - b.x, p.y - b.y);
  return std::abs(dx * (p.y - a.y) - dy * (p.x - a.x)) / std::sqrt(squared);
}

// Returns the square of the distance, up to rounding, without taking a root.
double SquaredDistanceToSegment(const Point& p, const Point& a, const Point& b) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double px = p.x - a.x, py = p.y - a.y;
  const double along = px * dx + py * dy;
  const double squared = dx * dx + dy * dy;
  if (!(along > 0.0)) return px * px + py * py;
  if (along >= squared) return (p.x - b.x) * (p.x - b.x) + (p.y - b.y) * (p.y - b.y);
  const double cross = dx * py - dy * px;
  return cross * cross / squared;
}

// An edge of a ring.
struct Segment {
  Point a, b;

  Box bounds() const {
    return {{std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}};
  }
};

// Returns whether two closed segments share a point.
bool Intersects(const Segment& s, const Segment& t) {
  if (!s.bounds().Intersects(t.bounds())) return false;
  if (Orientation(s.a, s.b, t.a) * Orientation(s.a, s.b, t.b) > 0) return false;
  // If all four points are on one line, the boxes have decided.
  return Orientation(t.a, t.b, s.a) * Orientation(t.a, t.b, s.b) <= 0;
}

// Returns whether a segment may intersect `box`, which its own bounding box does: the line through
// the segment must separate corners of the box.
bool MayMeet(const Segment& s, const Box& box) {
  // The two corners of `box` that a line of this slope must separate, or touch, to meet the box.
  Point first = box.min, second = box.max;
  if ((s.b.x > s.a.x) == (s.b.y > s.a.y)) std::swap(first.y, second.y);
  return Orientation(s.a, s.b, first) * Orientation(s.a, s.b, second) <= 0;
}

// Finds the segment that is nearest to a point. Takes roots only for segments whose rounded squared
// distances may be the least.
class NearestSegment {
 public:
  explicit NearestSegment(const Point& p) : p_(p) {}

  void Add(const Segment& segment) {
    const double square = SquaredDistanceToSegment(p_, segment.a, segment.b);
    if (square > least_square_ * kRounding) return;
    least_square_ = std::min(least_square_, square);
    candidates_.push_back({square, segment});
  }

  // Returns infinity if no segment was added.
  double Distance() const {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [square, segment] : candidates_) {
      if (square > least_square_ * kRounding) continue;
      nearest = std::min(nearest, DistanceToSegment(p_, segment.a, segment.b));
    }
    return nearest;
  }

 private:
  static constexpr double kRounding = 1.0 + 1e-9;
  struct Candidate {
    double square;
    Segment segment;
  };

  const Point p_;
  double least_square_ = std::numeric_limits<double>::infinity();
  absl::InlinedVector<Candidate, 8> candidates_;
};

bool IsOnSegment(const Segment& segment, const Point& p) {
  return segment.bounds().Covers(p) && Orientation(segment.a, segment.b, p) == 0;
}

template <typename Visit>
void ForEachEdge(const LineString& line, Visit visit) {
  const std::vector<Point>& vertices = line.vertices();
  for (size_t i = 1; i < vertices.size(); ++i) visit(Segment{vertices[i - 1], vertices[i]});
}

template <typename Visit>
void ForEachEdge(const Polygon& polygon, Visit visit) {
  for (const Ring& ring : polygon.rings()) {
    Point a = ring.back();
    for (const Point& b : ring) {
      visit(Segment{a, b});
      a = b;
    }
  }
}

// Returns whether the boundary of `p` intersects a line string or the boundary of another polygon.
template <typename Other>
bool BoundariesIntersect(const Polygon& p, const Other& q) {
  const Box shared{
      {std::max(p.bounds().min.x, q.bounds().min.x), std::max(p.bounds().min.y, q.bounds().min.y)},
      {std::min(p.bounds().max.x, q.bounds().max.x), std::min(p.bounds().max.y, q.bounds().max.y)}};
  absl::InlinedVector<Segment, 32> edges;
  ForEachEdge(p, [&](const Segment& edge) {
    if (edge.bounds().Intersects(shared) && MayMeet(edge, shared)) edges.push_back(edge);
  });
  if (edges.empty()) return false;
  bool found = false;
  ForEachEdge(q, [&](const Segment& edge) {
    if (found || !edge.bounds().Intersects(shared)) return;
    found = std::any_of(edges.begin(), edges.end(),
                        [&edge](const Segment& other) { return Intersects(edge, other); });
  });
  return found;
}

}  // namespace

int Orientation(const Point& a, const Point& b, const Point& c) {
  const double acx = a.x - c.x, bcx = b.x - c.x, acy = a.y - c.y, bcy = b.y - c.y;
  if ((acx == 0.0 || bcy == 0.0) && (acy == 0.0 || bcx == 0.0)) return 0;
  const double left = acx * bcy, right = acy * bcx;
  const double determinant = left - right;
  // Shewchuk's error bound A, plus a margin for products that underflow.
  constexpr double kHalfUlp = std::numeric_limits<double>::epsilon() / 2;
  constexpr double kBound = (3.0 + 16.0 * kHalfUlp) * kHalfUlp;
  constexpr double kUnderflow = 1e-290;
  if (std::abs(determinant) > kBound * (std::abs(left) + std::abs(right)) + kUnderflow &&
      std::isfinite(determinant)) {
    return Sign(determinant);
  }
  return ExactOrientation(a, b, c);
}

bool Covers(const Polygon& polygon, const Point& p) {
  if (!polygon.bounds().Covers(p)) return false;
  bool outer = true;
  for (const Ring& ring : polygon.rings()) {
    const Location location = Locate(ring, p);
    if (location == Location::kBoundary) return true;
    if (location == (outer ? Location::kOutside : Location::kInside)) return false;
    outer = false;
  }
  return true;
}

double Distance(const Polygon& polygon, const Point& p) {
  if (Covers(polygon, p)) return 0.0;
  NearestSegment nearest(p);
  ForEachEdge(polygon, [&](const Segment& edge) { nearest.Add(edge); });
  return nearest.Distance();
}

bool Covers(const LineString& line, const Point& p) {
  if (!line.bounds().Covers(p)) return false;
  bool covers = false;
  ForEachEdge(line, [&](const Segment& edge) { covers = covers || IsOnSegment(edge, p); });
  return covers;
}

double Distance(const LineString& line, const Point& p) {
  if (Covers(line, p)) return 0.0;
  NearestSegment nearest(p);
  ForEachEdge(line, [&](const Segment& edge) { nearest.Add(edge); });
  return nearest.Distance();
}

bool Covers(const Shape& shape, const Point& p) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return Covers(shape.polygon(), p);
    case ShapeKind::kLineString:
      return Covers(shape.line_string(), p);
    case ShapeKind::kPoint:
      break;
  }
  return shape.point() == p;
}

double Distance(const Shape& shape, const Point& p) {
  switch (shape.kind()) {
    case ShapeKind::kPolygon:
      return Distance(shape.polygon(), p);
    case ShapeKind::kLineString:
      return Distance(shape.line_string(), p);
    case ShapeKind::kPoint:
      break;
  }
  return std::hypot(shape.point().x - p.x, shape.point().y - p.y);
}

// GEOS takes tens of microseconds to prepare a polygon, and copies each shape that it tests. That
// pays for large polygons or many tests. Until then, the edges are scanned here, with the same
// exact predicates.
struct PreparedPolygon::Impl {
  explicit Impl(const Polygon& p) : polygon(p), num_vertices(p.num_vertices()) {}

  // The polygon as prepared by GEOS. It has its own context, since the object may move between
  // threads.
  struct InGeos {
    explicit InGeos(const Polygon& p)
        : geometry(context.MakePolygon(p.rings())),
          prepared(geometry == nullptr ? nullptr
                                       : GEOSPrepare_r(context.handle(), geometry.get())) {}
    ~InGeos() {
      if (prepared != nullptr) GEOSPreparedGeom_destroy_r(context.handle(), prepared);
    }
    InGeos(const InGeos&) = delete;
    InGeos& operator=(const InGeos&) = delete;

    const GeosContext context;
    const GeosGeometry geometry;
    const GEOSPreparedGeometry* const prepared;
  };
  const InGeos& Geos() {
    if (in_geos == nullptr) in_geos = std::make_unique<const InGeos>(polygon);
    return *in_geos;
  }

  // Returns whether to scan the edges for the next test, of a shape with `num_others` vertices, and
  // counts the test.
  bool IsCheap(int num_others) {
    constexpr int64_t kAlways = 4096;
    constexpr int64_t kInAll = 1 << 16;
    const int64_t num_pairs = int64_t{num_vertices} * num_others;
    if (num_pairs <= kAlways) return true;
    num_pairs_tested += num_pairs;
    return num_pairs_tested <= kInAll;
  }

  const Polygon polygon;
  const int num_vertices;
  int64_t num_pairs_tested = 0;
  std::unique_ptr<const InGeos> in_geos;
};

PreparedPolygon::PreparedPolygon(const Polygon& polygon) : impl_(std::make_unique<Impl>(polygon)) {}
PreparedPolygon::PreparedPolygon(PreparedPolygon&&) noexcept = default;
PreparedPolygon& PreparedPolygon::operator=(PreparedPolygon&&) noexcept = default;
PreparedPolygon::~PreparedPolygon() = default;

bool PreparedPolygon::Intersects(const Shape& other) const {
  const Polygon& polygon = impl_->polygon;
  if (polygon.empty() || other.empty() || !polygon.bounds().Intersects(other.bounds())) {
    return false;
  }
  if (impl_->IsCheap(other.num_vertices())) {
    if (other.kind() == ShapeKind::kPoint) return hypermap::Covers(polygon, other.point());
    // If the boundaries do not intersect, one shape contains all of the other or none of it.
    if (hypermap::Covers(polygon, other.any_vertex())) return true;
    if (other.kind() == ShapeKind::kLineString) {
      return BoundariesIntersect(polygon, other.line_string());
    }
    return hypermap::Covers(other.polygon(), polygon.outer().front()) ||
           BoundariesIntersect(polygon, other.polygon());
  }
  const Impl::InGeos& geos = impl_->Geos();
  if (geos.prepared == nullptr) return false;
  const GeosGeometry geometry = geos.context.MakeGeometry(other);
  return geometry != nullptr &&
         GEOSPreparedIntersects_r(geos.context.handle(), geos.prepared, geometry.get()) == 1;
}

bool PreparedPolygon::Covers(const Shape& other) const {
  const Polygon& polygon = impl_->polygon;
  if (polygon.empty() || other.empty() || !polygon.bounds().Intersects(other.bounds())) {
    return false;
  }
  if (other.kind() == ShapeKind::kPoint && impl_->IsCheap(/*num_others=*/1)) {
    return hypermap::Covers(polygon, other.point());
  }
  const Impl::InGeos& geos = impl_->Geos();
  if (geos.prepared == nullptr) return false;
  const GeosGeometry geometry = geos.context.MakeGeometry(other);
  return geometry != nullptr &&
         GEOSPreparedCovers_r(geos.context.handle(), geos.prepared, geometry.get()) == 1;
}

}  // namespace hypermap
