#include "storage/interchange/wkt.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int kManyVertices = 1000;

WktShape ParseShape(const std::string& text) {
  const absl::StatusOr<WktShape> shape = ParseWkt(text, kManyVertices);
  EXPECT_TRUE(shape.ok()) << text << ": " << shape.status();
  return shape.value_or(WktShape());
}

const Ring kTriangle = {{0, 0}, {1, 0}, {0, 1}};

TEST(ParseWktTest, ClosedRingNeedsNoRepair) {
  const WktShape shape = ParseShape("POLYGON((0 0,1 0,0 1,0 0))");
  EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle)));
  EXPECT_THAT(shape.repairs, IsEmpty());
}

TEST(ParseWktTest, TakesAnyCaseAndBlanks) {
  for (const char* text : {"polygon((0 0,1 0,0 1,0 0))", " Polygon ( ( 0  0 , 1 0 ,0\t1,0 0 ) ) ",
                           "POLYGON\n((0e0 0.0,+1 -0,.0 1.,0 0))"}) {
    const WktShape shape = ParseShape(text);
    EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle))) << text;
    EXPECT_THAT(shape.repairs, IsEmpty()) << text;
  }
}

TEST(ParseWktTest, OpenRingIsReported) {
  const WktShape shape = ParseShape("POLYGON((0 0,1 0,0 1))");
  EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle)));
  EXPECT_THAT(shape.repairs, ElementsAre("ring left open"));
}

TEST(ParseWktTest, FourNumbersBetweenCommasAreTwoVertices) {
  const WktShape shape = ParseShape("POLYGON((0 0,1 0 0 1,0 0))");
  EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle)));
  EXPECT_THAT(shape.repairs, ElementsAre("missing comma after vertex 2"));
}

TEST(ParseWktTest, HolesAndPartsNameThemselves) {
  const WktShape shape =
      ParseShape("MULTIPOLYGON(((0 0,9 0,0 9,0 0),(1 1,2 1,1 2)),((20 0,29 0 20 9,20 0)))");
  ASSERT_THAT(shape.polygons, SizeIs(2));
  EXPECT_THAT(shape.polygons[0], SizeIs(2));
  EXPECT_THAT(shape.polygons[1], SizeIs(1));
  EXPECT_THAT(shape.repairs,
              ElementsAre("hole 1: ring left open", "part 2: missing comma after vertex 2"));
}

TEST(ParseWktTest, EmptyHasNoRings) {
  EXPECT_THAT(ParseShape("POLYGON EMPTY").polygons, ElementsAre(IsEmpty()));
  EXPECT_THAT(ParseShape("MULTIPOLYGON EMPTY").polygons, IsEmpty());
}

TEST(ParseWktTest, ReadsLineStrings) {
  const WktShape shape = ParseShape(" linestring ( 0 0, 1 0 ,0\t1 ) ");
  EXPECT_EQ(shape.kind, ShapeKind::kLineString);
  EXPECT_EQ(shape.vertices, kTriangle);
  EXPECT_THAT(shape.polygons, IsEmpty());
  EXPECT_THAT(shape.repairs, IsEmpty());
  // One that closes keeps its last vertex; repeated vertices stay for the caller to see.
  EXPECT_THAT(ParseShape("LINESTRING(0 0,1 0,0 0,0 0)").vertices, SizeIs(4));
  EXPECT_THAT(ParseShape("LINESTRING EMPTY").vertices, IsEmpty());
  EXPECT_THAT(ParseShape("LINESTRING(0 0 1 1)").repairs,
              ElementsAre("missing comma after vertex 1"));
}

TEST(ParseWktTest, ReadsPoints) {
  const WktShape shape = ParseShape("Point( -1.5 2e1 )");
  EXPECT_EQ(shape.kind, ShapeKind::kPoint);
  EXPECT_THAT(shape.vertices, ElementsAre(Point{-1.5, 20}));
  EXPECT_THAT(shape.repairs, IsEmpty());
  EXPECT_EQ(ParseShape("POINT EMPTY").kind, ShapeKind::kPoint);
  EXPECT_THAT(ParseShape("POINT EMPTY").vertices, IsEmpty());
}

TEST(ParseWktTest, CommentAfterTheShapeIsReported) {
  EXPECT_THAT(ParseShape("POLYGON((0 0,1 0,0 1,0 0))#centre 3 4").repairs,
              ElementsAre("comment after the shape"));
}

TEST(ParseWktTest, RefusesOtherTexts) {
  const std::pair<const char*, const char*> kCases[] = {
      {"", "no WKT"},
      {"MULTIPOINT(1 2)", "MULTIPOINT where POLYGON, MULTIPOLYGON, LINESTRING or POINT is needed"},
      {"MULTILINESTRING((1 2,3 4))", "MULTILINESTRING where"},
      {"POINT", "'(' expected at character 6"},
      {"POINT()", "finite number"},
      {"POINT(1)", "finite number"},
      {"POINT(1 2", "')' expected at character 10"},
      {"POINT(1 2 3)", "')' expected at character 11"},
      {"POINT(1 2,3 4)", "')'"},
      {"POINT(1 nan)", "finite number"},
      {"LINESTRING", "'('"},
      {"LINESTRING()", "finite number"},
      {"LINESTRING((0 0,1 1))", "finite number"},
      {"LINESTRING(0 0,1 1", "',' or ')'"},
      {"LINESTRING(0 0,1 1))", "the end"},
      {"GEOMETRYCOLLECTION(POLYGON((0 0,1 0,0 1,0 0)))", "GEOMETRYCOLLECTION"},
      {"POLYGON", "'(' expected at character 8"},
      {"POLYGON(", "'('"},
      {"POLYGON((", "finite number expected at character 10"},
      {"POLYGON(())", "finite number"},
      {"POLYGON((0 0,1 0,0 1,0 0)", "',' or ')'"},
      {"POLYGON((0 0,1 0,0 1,0 0)))", "the end"},
      {"POLYGON((0 0,1 0,0 1,0 0)) POLYGON((0 0,1 0,0 1,0 0))", "the end"},
      {"POLYGON((0 0,1 0,0))", "finite number"},
      {"POLYGON((0 0 5,1 0 5,0 1 5))", "finite number"},
      {"POLYGON((0 0,1 0,,0 1))", "finite number"},
      {"POLYGON((0 0,nan 0,0 1))", "finite number"},
      {"POLYGON((0 0,1e999 0,0 1))", "finite number"},
      {"POLYGON((0 0,inf 0,0 1))", "finite number"},
      {"POLYGON((0 0,0x10 0,0 1))", "finite number"},
      {"POLYGON((0 0,1 0;0 1))", "finite number"},
  };
  for (const auto& [text, message] : kCases) {
    const absl::Status status = ParseWkt(text, kManyVertices).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message)) << text;
  }
}

TEST(ParseWktTest, LimitsVertices) {
  EXPECT_TRUE(ParseWkt("POLYGON((0 0,1 0,0 1,0 0))", 4).ok());
  EXPECT_TRUE(ParseWkt("LINESTRING(0 0,1 0,0 1,0 0)", 4).ok());
  for (const char* text : {"POLYGON((0 0,1 0,0 1,0 0))", "LINESTRING(0 0,1 0,0 1,0 0)"}) {
    const absl::Status status = ParseWkt(text, 3).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
    EXPECT_THAT(std::string(status.message()), HasSubstr("--max_vertices"));
  }
}

TEST(FormatWktTest, WritesClosedRingsThatReadBackExactly) {
  const Polygon polygon =
      *Polygon::Make({{0.1, 0.2}, {1.0 / 3.0, 1e-17}, {1e9, 12345.678901234567}, {-3, 4}}, {});
  EXPECT_THAT(FormatWkt(*Polygon::Make(kTriangle)), "POLYGON((0 0,1 0,0 1,0 0))");
  const WktShape shape = ParseShape(FormatWkt(polygon));
  EXPECT_THAT(shape.repairs, IsEmpty());
  EXPECT_THAT(shape.polygons[0], ElementsAreArray(polygon.rings()));
  const Polygon holed = *Polygon::Make({{0, 0}, {9, 0}, {9, 9}}, {{{3, 1}, {5, 1}, {5, 3}}});
  EXPECT_THAT(ParseShape(FormatWkt(holed)).polygons[0], ElementsAreArray(holed.rings()));
}

TEST(FormatWktTest, WritesLineStringsAndPoints) {
  EXPECT_EQ(FormatWkt(*LineString::Make({{0, 0}, {1.5, 0}, {1.5, -2}})),
            "LINESTRING(0 0,1.5 0,1.5 -2)");
  EXPECT_EQ(FormatWkt(*Shape::MakePoint({0.1, -1e-7})), "POINT(0.1 -1e-07)");
}

// The shape of a text that needs no repair.
Shape ShapeOf(const WktShape& wkt) {
  switch (wkt.kind) {
    case ShapeKind::kPolygon:
      return Polygon::MakeUnchecked(Rings(wkt.polygons[0].begin(), wkt.polygons[0].end()));
    case ShapeKind::kLineString:
      return LineString::MakeUnchecked(wkt.vertices);
    case ShapeKind::kPoint:
      break;
  }
  return Shape::MakePointUnchecked(wkt.vertices[0]);
}

TEST(FormatWktTest, RandomShapesReadBackExactly) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int i = 0; i < 500; ++i) {
    const Point centre{hypermap::testing::Uniform(rng, -1e6, 1e6),
                       hypermap::testing::Uniform(rng, -10, 10)};
    const Shape shape =
        hypermap::testing::RandomShape(rng, centre, hypermap::testing::Uniform(rng, 1e-3, 1e3));
    const WktShape wkt = ParseShape(FormatWkt(shape));
    EXPECT_THAT(wkt.repairs, IsEmpty());
    EXPECT_EQ(ShapeOf(wkt), shape) << FormatWkt(shape);
  }
}

}  // namespace
}  // namespace hypermap::storage
