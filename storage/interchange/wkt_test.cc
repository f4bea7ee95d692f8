#include "storage/interchange/wkt.h"

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr int kManyVertices = 1000;

WktShape Parse(const std::string& text) {
  const absl::StatusOr<WktShape> shape = ParseWkt(text, kManyVertices);
  EXPECT_TRUE(shape.ok()) << text << ": " << shape.status();
  return shape.value_or(WktShape());
}

const Ring kTriangle = {{0, 0}, {1, 0}, {0, 1}};

TEST(ParseWktTest, ClosedRingNeedsNoRepair) {
  const WktShape shape = Parse("POLYGON((0 0,1 0,0 1,0 0))");
  EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle)));
  EXPECT_THAT(shape.repairs, IsEmpty());
}

TEST(ParseWktTest, TakesAnyCaseAndBlanks) {
  for (const char* text : {"polygon((0 0,1 0,0 1,0 0))", " Polygon ( ( 0  0 , 1 0 ,0\t1,0 0 ) ) ",
                           "POLYGON\n((0e0 0.0,+1 -0,.0 1.,0 0))"}) {
    const WktShape shape = Parse(text);
    EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle))) << text;
    EXPECT_THAT(shape.repairs, IsEmpty()) << text;
  }
}

TEST(ParseWktTest, OpenRingIsReported) {
  const WktShape shape = Parse("POLYGON((0 0,1 0,0 1))");
  EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle)));
  EXPECT_THAT(shape.repairs, ElementsAre("ring left open"));
}

TEST(ParseWktTest, FourNumbersBetweenCommasAreTwoVertices) {
  const WktShape shape = Parse("POLYGON((0 0,1 0 0 1,0 0))");
  EXPECT_THAT(shape.polygons, ElementsAre(ElementsAre(kTriangle)));
  EXPECT_THAT(shape.repairs, ElementsAre("missing comma after vertex 2"));
}

TEST(ParseWktTest, HolesAndPartsNameThemselves) {
  const WktShape shape =
      Parse("MULTIPOLYGON(((0 0,9 0,0 9,0 0),(1 1,2 1,1 2)),((20 0,29 0 20 9,20 0)))");
  ASSERT_THAT(shape.polygons, SizeIs(2));
  EXPECT_THAT(shape.polygons[0], SizeIs(2));
  EXPECT_THAT(shape.polygons[1], SizeIs(1));
  EXPECT_THAT(shape.repairs,
              ElementsAre("hole 1: ring left open", "part 2: missing comma after vertex 2"));
}

TEST(ParseWktTest, EmptyHasNoRings) {
  EXPECT_THAT(Parse("POLYGON EMPTY").polygons, ElementsAre(IsEmpty()));
  EXPECT_THAT(Parse("MULTIPOLYGON EMPTY").polygons, IsEmpty());
}

TEST(ParseWktTest, CommentAfterThePolygonIsReported) {
  EXPECT_THAT(Parse("POLYGON((0 0,1 0,0 1,0 0))#centre 3 4").repairs,
              ElementsAre("comment after the polygon"));
}

TEST(ParseWktTest, RefusesWhatIsNoPolygon) {
  const std::pair<const char*, const char*> kCases[] = {
      {"", "no WKT"},
      {"POINT(1 2)", "POINT"},
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
  const absl::Status status = ParseWkt("POLYGON((0 0,1 0,0 1,0 0))", 3).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(status.message()), HasSubstr("max_vertices_per_polygon"));
}

TEST(FormatWktTest, WritesClosedRingsThatReadBackExactly) {
  const Polygon polygon =
      *Polygon::Make({{0.1, 0.2}, {1.0 / 3.0, 1e-17}, {1e9, 12345.678901234567}, {-3, 4}}, {});
  EXPECT_THAT(FormatWkt(*Polygon::Make(kTriangle)), "POLYGON((0 0,1 0,0 1,0 0))");
  const WktShape shape = Parse(FormatWkt(polygon));
  EXPECT_THAT(shape.repairs, IsEmpty());
  EXPECT_THAT(shape.polygons[0], ElementsAreArray(polygon.rings()));
  const Polygon holed = *Polygon::Make({{0, 0}, {9, 0}, {9, 9}}, {{{3, 1}, {5, 1}, {5, 3}}});
  EXPECT_THAT(Parse(FormatWkt(holed)).polygons[0], ElementsAreArray(holed.rings()));
}

}  // namespace
}  // namespace hypermap::storage
