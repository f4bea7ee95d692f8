#include "map/geometry/predicates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "map/geometry/geos_context.h"

namespace hypermap {
namespace {

int Sign(double v) { return (v > 0.0) - (v < 0.0); }

// The sum of `terms` as a nonoverlapping expansion; its sign is that of the last non-zero component
// (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates",
// 1997, figure 6).
template <size_t kTerms>
int SignOfSum(const std::array<double, kTerms>& terms) {
  std::array<double, kTerms> expansion{};
  for (size_t i = 0; i < kTerms; ++i) {
    double carry = terms[i];
    for (size_t j = 0; j < i; ++j) {
      const double sum = carry + expansion[j];
      const double rounded = sum - carry;
      expansion[j] = (carry - (sum - rounded)) + (expansion[j] - rounded);
      carry = sum;
    }
    expansion[i] = carry;
  }
  for (size_t i = kTerms; i-- > 0;) {
    if (expansion[i] != 0.0) return Sign(expansion[i]);
  }
  return 0;
}

// The determinant multiplied out into six products of coordinates, each exact as a pair of doubles.
int ExactOrientation(Point a, Point b, Point c) {
  // A common power of two takes products far from overflow and underflow and changes no sign.
  double largest = 0.0;
  for (const Point& p : {a, b, c}) largest = std::max({largest, std::abs(p.x), std::abs(p.y)});
  if (largest == 0.0 || !std::isfinite(largest)) return 0;
  const int exponent = std::ilogb(largest);
  for (Point* p : {&a, &b, &c}) {
    *p = {std::scalbn(p->x, -exponent), std::scalbn(p->y, -exponent)};
  }
  std::array<double, 12> terms;
  size_t n = 0;
  const auto add_product = [&](double u, double v) {
    const double product = u * v;
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

enum class Location { kInside, kBoundary, kOutside };

// Counts the edges that a ray from `p` to the right crosses. An edge owns its lower end only, so
// that the ray through a vertex counts as many edges as it changes sides.
Location Locate(const Ring& ring, const Point& p) {
  bool inside = false;
  Point a = ring.back();
  for (const Point& b : ring) {
    if (b == p) return Location::kBoundary;
    if ((a.y > p.y) != (b.y > p.y)) {
      const int turn = Orientation(a, b, p);
      if (turn == 0) return Location::kBoundary;
      if ((turn > 0) == (b.y > a.y)) inside = !inside;
    } else if (a.y == p.y && b.y == p.y && (a.x > p.x) != (b.x > p.x)) {
      return Location::kBoundary;
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

}  // namespace

int Orientation(const Point& a, const Point& b, const Point& c) {
  const double acx = a.x - c.x, bcx = b.x - c.x, acy = a.y - c.y, bcy = b.y - c.y;
  if ((acx == 0.0 || bcy == 0.0) && (acy == 0.0 || bcx == 0.0)) return 0;
  const double left = acx * bcy, right = acy * bcx;
  const double determinant = left - right;
  // Shewchuk's bound A, and room for products that underflow.
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
  double nearest = std::numeric_limits<double>::infinity();
  for (const Ring& ring : polygon.rings()) {
    Point a = ring.back();
    for (const Point& b : ring) {
      nearest = std::min(nearest, DistanceToSegment(p, a, b));
      a = b;
    }
  }
  return nearest;
}

struct PreparedPolygon::Impl {
  explicit Impl(const Polygon& p)
      : polygon(p),
        geometry(geos.MakePolygon(p.rings())),
        prepared(geometry == nullptr ? nullptr : GEOSPrepare_r(geos.handle(), geometry.get())) {}
  ~Impl() {
    if (prepared != nullptr) GEOSPreparedGeom_destroy_r(geos.handle(), prepared);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  const Polygon polygon;
  // Its own, as the object may be handed from thread to thread.
  const GeosContext geos;
  const GeosGeometry geometry;
  const GEOSPreparedGeometry* const prepared;
};

PreparedPolygon::PreparedPolygon(const Polygon& polygon) : impl_(std::make_unique<Impl>(polygon)) {}
PreparedPolygon::PreparedPolygon(PreparedPolygon&&) noexcept = default;
PreparedPolygon& PreparedPolygon::operator=(PreparedPolygon&&) noexcept = default;
PreparedPolygon::~PreparedPolygon() = default;

bool PreparedPolygon::Intersects(const Polygon& other) const {
  if (impl_->prepared == nullptr || !impl_->polygon.bounds().Intersects(other.bounds())) {
    return false;
  }
  const GeosGeometry geometry = impl_->geos.MakePolygon(other.rings());
  return geometry != nullptr &&
         GEOSPreparedIntersects_r(impl_->geos.handle(), impl_->prepared, geometry.get()) == 1;
}

bool PreparedPolygon::Covers(const Polygon& other) const {
  if (impl_->prepared == nullptr || !impl_->polygon.bounds().Intersects(other.bounds())) {
    return false;
  }
  const GeosGeometry geometry = impl_->geos.MakePolygon(other.rings());
  return geometry != nullptr &&
         GEOSPreparedCovers_r(impl_->geos.handle(), impl_->prepared, geometry.get()) == 1;
}

}  // namespace hypermap
