#include "map/geometry/shape.h"

#include <geos_c.h>

#include <limits>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/geos_context.h"
#include "map/geometry/predicates.h"
#include "tests/support/not_finite.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::DoubleNear;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

using hypermap::testing::kNan;

LineString Line(std::vector<Point> vertices) { return *LineString::Make(std::move(vertices)); }

Shape PointAt(double x, double y) { return *Shape::MakePoint({x, y}); }

// Points are on a coarse lattice, so that shapes touch, share vertices and lie on each other's
// edges.
Point LatticePoint(Rng& rng) {
  return {UniformInt(rng, -4, 4) / 2.0, UniformInt(rng, -4, 4) / 2.0};
}

Shape RandomLine(Rng& rng) {
  std::vector<Point> vertices;
  const int count = UniformInt(rng, 2, 6);
  for (int i = 0; i < count; ++i) vertices.push_back(LatticePoint(rng));
  absl::StatusOr<LineString> line = LineString::Make(vertices);
  return line.ok() ? Shape(*std::move(line)) : RandomLine(rng);
}

Shape RandomShape(Rng& rng) {
  switch (UniformInt(rng, 0, 2)) {
    case 0:
      return *Shape::MakePoint(LatticePoint(rng));
    case 1:
      return RandomLine(rng);
    default:
      break;
  }
  std::vector<Point> ring;
  for (int i = 0; i < 4; ++i) ring.push_back(LatticePoint(rng));
  absl::StatusOr<Polygon> polygon = Polygon::Make(ring);
  return polygon.ok() ? Shape(*std::move(polygon)) : RandomShape(rng);
}

TEST(ShapeTest, KindsHaveNames) {
  for (const ShapeKind kind : kAllShapeKinds) EXPECT_EQ(ParseShapeKind(ShapeKindName(kind)), kind);
  EXPECT_EQ(ParseShapeKind("circle"), std::nullopt);
}

TEST(ShapeTest, ASetOfKindsHoldsAllUnlessItNamesSome) {
  EXPECT_TRUE(ShapeKinds().ContainsAll());
  const ShapeKinds lines{ShapeKind::kLineString};
  EXPECT_TRUE(lines.Contains(ShapeKind::kLineString));
  EXPECT_FALSE(lines.Contains(ShapeKind::kPoint));
  EXPECT_FALSE(lines.ContainsAll());
  EXPECT_TRUE(ShapeKinds({}).empty());
}

TEST(LineStringTest, DropsRepeatedVerticesAndKeepsOrder) {
  const LineString line = Line({{0, 0}, {0, 0}, {1, 0}, {1, 0}, {0, 0}});
  EXPECT_EQ(line.vertices(), (std::vector<Point>{{0, 0}, {1, 0}, {0, 0}}));
  EXPECT_EQ(line.bounds(), (Box{{0, 0}, {1, 0}}));
}

TEST(LineStringTest, RefusesWhatIsNoLine) {
  EXPECT_EQ(LineString::Make({}).status().message(),
            "line string has fewer than 2 distinct vertices");
  EXPECT_EQ(LineString::Make({{1, 1}, {1, 1}}).status().message(),
            "line string has fewer than 2 distinct vertices");
  EXPECT_EQ(LineString::Make({{1, 1}, {kNan, 1}}).status().message(), "vertices[1] is not finite");
  EXPECT_EQ(LineString::Make({{1e10, 1}, {0, 1}}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(LineStringTest, LengthAndCentroidAreWeightedByLength) {
  const LineString line = Line({{0, 0}, {4, 0}, {4, 2}});
  EXPECT_DOUBLE_EQ(Length(line), 6.0);
  EXPECT_THAT(Centroid(line).x, DoubleNear((4 * 2.0 + 2 * 4.0) / 6, 1e-12));
  EXPECT_THAT(Centroid(line).y, DoubleNear((4 * 0.0 + 2 * 1.0) / 6, 1e-12));
}

TEST(ShapeTest, PointsAreCheckedAndCoverOnlyThemselves) {
  EXPECT_EQ(Shape::MakePoint({kNan, 0}).status().message(), "point is not finite");
  EXPECT_EQ(Shape::MakePoint({0, 2e9}).status().code(), absl::StatusCode::kInvalidArgument);
  const Shape point = PointAt(1, 2);
  EXPECT_EQ(point.bounds(), (Box{{1, 2}, {1, 2}}));
  EXPECT_EQ(point.num_vertices(), 1);
  EXPECT_FALSE(point.empty());
  EXPECT_TRUE(Covers(point, {1, 2}));
  EXPECT_FALSE(Covers(point, {1, 2.0000001}));
  EXPECT_DOUBLE_EQ(Distance(point, {4, 6}), 5.0);
  EXPECT_EQ(Centroid(point), (Point{1, 2}));
  EXPECT_EQ(Length(point), 0.0);
}

TEST(ShapeTest, TheDefaultShapeIsEmpty) {
  EXPECT_TRUE(Shape().empty());
  EXPECT_FALSE(Covers(Shape(), {0, 0}));
  EXPECT_EQ(Distance(Shape(), {0, 0}), std::numeric_limits<double>::infinity());
  EXPECT_EQ(Length(Shape()), 0.0);
}

TEST(ShapeTest, ALineIsMetExactly) {
  const Shape line = Line({{0, 0}, {3, 1}});
  EXPECT_TRUE(Covers(line, {0, 0}));
  EXPECT_TRUE(Covers(line, {1.5, 0.5}));
  EXPECT_FALSE(Covers(line, {1.5, 0.5000001}));
  EXPECT_FALSE(Covers(line, {6, 2}));
}

TEST(ShapeTest, MeasuresAgreeWithGeos) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const GeosContext& geos = GeosContext::OfThisThread();
  for (int i = 0; i < 500; ++i) {
    const Shape shape = RandomShape(rng);
    const GeosGeometry geometry = geos.MakeGeometry(shape);
    ASSERT_NE(geometry, nullptr);
    double area = -1, length = -1;
    ASSERT_EQ(GEOSArea_r(geos.handle(), geometry.get(), &area), 1);
    ASSERT_EQ(GEOSLength_r(geos.handle(), geometry.get(), &length), 1);
    EXPECT_THAT(Area(shape), DoubleNear(area, 1e-9));
    EXPECT_THAT(Length(shape), DoubleNear(length, 1e-9));
    const GeosGeometry centre = geos.Own(GEOSGetCentroid_r(geos.handle(), geometry.get()));
    Point expected;
    GEOSGeomGetX_r(geos.handle(), centre.get(), &expected.x);
    GEOSGeomGetY_r(geos.handle(), centre.get(), &expected.y);
    EXPECT_THAT(Centroid(shape).x, DoubleNear(expected.x, 1e-9));
    EXPECT_THAT(Centroid(shape).y, DoubleNear(expected.y, 1e-9));
    const Point p = LatticePoint(rng);
    const GeosGeometry at = geos.MakeGeometry(*Shape::MakePoint(p));
    double distance = -1;
    ASSERT_EQ(GEOSDistance_r(geos.handle(), geometry.get(), at.get(), &distance), 1);
    EXPECT_THAT(Distance(shape, p), DoubleNear(distance, 1e-12));
    EXPECT_EQ(Covers(shape, p), GEOSIntersects_r(geos.handle(), geometry.get(), at.get()) == 1);
  }
}

TEST(ShapeTest, AreasMeetShapesAsGeosSays) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  const GeosContext& geos = GeosContext::OfThisThread();
  for (int i = 0; i < 1000; ++i) {
    Shape area = RandomShape(rng);
    while (!area.is_polygon()) area = RandomShape(rng);
    const PreparedPolygon prepared(area.polygon());
    const GeosGeometry left = geos.MakeGeometry(area);
    const Shape other = RandomShape(rng);
    const GeosGeometry right = geos.MakeGeometry(other);
    EXPECT_EQ(prepared.Intersects(other),
              GEOSIntersects_r(geos.handle(), left.get(), right.get()) == 1);
    EXPECT_EQ(prepared.Covers(other), GEOSCovers_r(geos.handle(), left.get(), right.get()) == 1);
  }
}

// Above a certain number of pairs of edges, the prepared geometry of GEOS is used.
TEST(ShapeTest, LongLinesMeetAreasAsShortOnesDo) {
  std::vector<Point> zigzag;
  for (int i = 0; i < 5000; ++i) zigzag.push_back({i * 0.01, i % 2 == 0 ? 0.0 : 1.0});
  const Shape line = Line(zigzag);
  const PreparedPolygon above(Polygon::FromBox({{0, 1.5}, {50, 2}}));
  const PreparedPolygon across(*Polygon::Make({{0, 0.5}, {50, 0.5}, {25, 0.6}}));
  for (int i = 0; i < 20; ++i) {
    EXPECT_FALSE(above.Intersects(line));
    EXPECT_TRUE(across.Intersects(line));
  }
}

TEST(ShapeTest, FootprintsOfLinesAndPointsHaveAnArea) {
  EXPECT_EQ(FootprintOf(PointAt(1, 1), 0.5), Polygon::FromBox({{0.5, 0.5}, {1.5, 1.5}}));
  EXPECT_EQ(FootprintOf(Line({{0, 0}, {2, 0}}), 0.5), Polygon::FromBox({{-0.5, -0.5}, {2.5, 0.5}}));
  const Polygon square = Polygon::FromBox({{0, 0}, {1, 1}});
  EXPECT_EQ(FootprintOf(square, 0.5), square);
}

}  // namespace
}  // namespace hypermap
