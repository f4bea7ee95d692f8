#include "storage/encoding/geometry_blob.h"

#include <cmath>
#include <limits>

#include "absl/strings/escaping.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomShape;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;

// WKB of POLYGON ((0 0, 1 0, 1 1, 0 0)).
const char kWkb[] =
    "0103000000"
    "01000000"
    "04000000"
    "0000000000000000"
    "0000000000000000"
    "000000000000f03f"
    "0000000000000000"
    "000000000000f03f"
    "000000000000f03f"
    "0000000000000000"
    "0000000000000000";
const Ring kTriangle = {{0, 0}, {1, 0}, {1, 1}};

// WKB of LINESTRING (0 0, 1 0, 1 1).
const char kLineWkb[] =
    "0102000000"
    "03000000"
    "0000000000000000"
    "0000000000000000"
    "000000000000f03f"
    "0000000000000000"
    "000000000000f03f"
    "000000000000f03f";

// WKB of POINT (1 -2).
const char kPointWkb[] =
    "0101000000"
    "000000000000f03f"
    "00000000000000c0";

Shape PointAt(double x, double y) { return *Shape::MakePoint({x, y}); }

std::string Blob(const std::string& header, const std::string& wkb) {
  return absl::HexStringToBytes(header + wkb);
}

TEST(GeometryBlobTest, IsTheBytesOfTheStandard) {
  const std::string unit_envelope =
      "0000000000000000"
      "000000000000f03f"
      "0000000000000000"
      "000000000000f03f";
  EXPECT_EQ(absl::BytesToHexString(EncodeGeometryBlob(*Polygon::Make(kTriangle))),
            "47500003ffffffff" + unit_envelope + kWkb);
  EXPECT_EQ(absl::BytesToHexString(EncodeGeometryBlob(*LineString::Make(kTriangle))),
            "47500003ffffffff" + unit_envelope + kLineWkb);
  EXPECT_EQ(absl::BytesToHexString(EncodeGeometryBlob(PointAt(1, -2))),
            std::string("47500001ffffffff") + kPointWkb);
}

TEST(GeometryBlobTest, RandomShapesComeBackAsTheyAre) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int i = 0; i < 1000; ++i) {
    const Point centre{testing::Uniform(rng, -1e5, 1e5), testing::Uniform(rng, -1e5, 1e5)};
    const Shape shape = RandomShape(rng, centre, std::pow(10, testing::Uniform(rng, -3, 3)));
    const std::string blob = EncodeGeometryBlob(shape);
    const auto decoded = DecodeGeometryBlob(blob);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, shape);
    EXPECT_EQ(*BoxOfGeometryBlob(blob), shape.bounds());
    // A motion rounds: the result need not be valid any more, but comes back unchanged.
    const Shape moved = testing::RandomTransform(rng, 1e6) * shape;
    EXPECT_EQ(*DecodeGeometryBlob(EncodeGeometryBlob(moved)), moved);
  }
}

TEST(GeometryBlobTest, TakesWhatOtherProgramsWrite) {
  const Polygon triangle = *Polygon::Make(kTriangle);
  const struct {
    const char* what;
    std::string blob;
  } cases[] = {
      {"no envelope", Blob("47500001ffffffff", kWkb)},
      {"another srs_id", Blob("47500001e6100000", kWkb)},
      {"big-endian header", Blob("47500000ffffffff", kWkb)},
      {"XYZ envelope", Blob("47500005ffffffff" + std::string(96, '0'), kWkb)},
      {"XYZM envelope", Blob("47500009ffffffff" + std::string(128, '0'), kWkb)},
      {"big-endian WKB", Blob("47500001ffffffff",
                              "00000000030000000100000004"
                              "0000000000000000"
                              "0000000000000000"
                              "3ff0000000000000"
                              "0000000000000000"
                              "3ff0000000000000"
                              "3ff0000000000000"
                              "0000000000000000"
                              "0000000000000000")},
      {"clockwise", Blob("47500001ffffffff",
                         "0103000000"
                         "01000000"
                         "04000000"
                         "0000000000000000"
                         "0000000000000000"
                         "000000000000f03f"
                         "000000000000f03f"
                         "000000000000f03f"
                         "0000000000000000"
                         "0000000000000000"
                         "0000000000000000")},
  };
  for (const auto& c : cases) {
    const auto polygon = DecodeGeometryBlob(c.blob);
    ASSERT_TRUE(polygon.ok()) << c.what << ": " << polygon.status();
    EXPECT_EQ(*polygon, triangle) << c.what;
  }
  EXPECT_EQ(*BoxOfGeometryBlob(cases[0].blob), triangle.bounds());
  EXPECT_TRUE(BoxOfGeometryBlob(absl::HexStringToBytes("47500011ffffffff"))->empty());
}

TEST(GeometryBlobTest, TakesLinesAndPointsOfOtherPrograms) {
  const LineString line = *LineString::Make(kTriangle);
  const Shape point = PointAt(1, -2);
  const std::string point_envelope =
      "000000000000f03f"
      "000000000000f03f"
      "00000000000000c0"
      "00000000000000c0";
  const struct {
    const char* what;
    std::string blob;
    Shape shape;
  } cases[] = {
      {"line without envelope", Blob("47500001ffffffff", kLineWkb), line},
      {"big-endian line",
       Blob("47500000ffffffff",
            "000000000200000003"
            "0000000000000000"
            "0000000000000000"
            "3ff0000000000000"
            "0000000000000000"
            "3ff0000000000000"
            "3ff0000000000000"),
       line},
      {"point with envelope", Blob("47500003ffffffff" + point_envelope, kPointWkb), point},
      {"big-endian point",
       Blob("47500000ffffffff",
            "0000000001"
            "3ff0000000000000"
            "c000000000000000"),
       point},
  };
  for (const auto& c : cases) {
    const auto shape = DecodeGeometryBlob(c.blob);
    ASSERT_TRUE(shape.ok()) << c.what << ": " << shape.status();
    EXPECT_EQ(*shape, c.shape) << c.what;
    EXPECT_EQ(*BoxOfGeometryBlob(c.blob), c.shape.bounds()) << c.what;
  }
}

TEST(GeometryBlobTest, EveryCutIsDamage) {
  const Shape shapes[] = {
      *Polygon::Make({{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{{1, 1}, {1, 2}, {2, 2}}}),
      *LineString::Make({{0, 0}, {9, 0}, {9, 9}}), PointAt(3, 4)};
  for (const Shape& shape : shapes) {
    SCOPED_TRACE(ShapeKindName(shape.kind()));
    const std::string blob = EncodeGeometryBlob(shape);
    for (size_t size = 0; size < blob.size(); ++size) {
      EXPECT_EQ(DecodeGeometryBlob(blob.substr(0, size)).status().code(),
                absl::StatusCode::kDataLoss);
    }
    EXPECT_EQ(DecodeGeometryBlob(blob + "x").status().code(), absl::StatusCode::kDataLoss);
  }
}

TEST(GeometryBlobTest, HostileBlobsAreDamage) {
  const std::string nan = "000000000000f87f";
  const std::string zero = "0000000000000000";
  const struct {
    const char* what;
    std::string header;
    std::string wkb;
  } cases[] = {
      {"wrong magic", "47510001ffffffff", kWkb},
      {"wrong version", "47500101ffffffff", kWkb},
      {"extended", "47500021ffffffff", kWkb},
      {"unknown envelope", "4750000fffffffff", kWkb},
      {"another kind of geometry", "47500001ffffffff", "010700000000000000"},
      {"a point with Z", "47500001ffffffff", "01e9030000" + zero + zero + zero},
      {"an empty point", "47500011ffffffff", "0101000000" + nan + nan},
      {"a point that is not finite", "47500001ffffffff", "0101000000" + zero + nan},
      {"an empty line", "47500011ffffffff", "010200000000000000"},
      {"a line of one vertex", "47500001ffffffff", "010200000001000000" + zero + zero},
      {"a line that is not finite", "47500001ffffffff",
       "010200000002000000" + zero + zero + nan + zero},
      {"a line of four billion vertices", "47500001ffffffff", "0102000000ffffffff"},
      {"wrong byte order", "47500001ffffffff", std::string("02") + (kWkb + 2)},
      {"no rings", "47500001ffffffff", "010300000000000000"},
      {"four billion rings", "47500001ffffffff", "0103000000ffffffff"},
      {"four billion points", "47500001ffffffff", "010300000001000000ffffffff"},
      {"three points", "47500001ffffffff",
       "01030000000100000003000000" + zero + zero + zero + zero + zero + zero},
      {"not finite", "47500001ffffffff",
       "01030000000100000004000000" + zero + zero + nan + zero + nan + nan + zero + zero},
      {"not closed", "47500001ffffffff",
       "01030000000100000004000000" + zero + zero + "000000000000f03f" + zero + "000000000000f03f" +
           "000000000000f03f" + zero + "000000000000f03f"},
      {"crossing and clockwise", "47500001ffffffff",
       std::string("01030000000100000006000000") + "0000000000000000"
                                                   "0000000000000000"
                                                   "0000000000000840"
                                                   "0000000000000840"
                                                   "0000000000000840"
                                                   "0000000000000000"
                                                   "0000000000000000"
                                                   "0000000000000040"
                                                   "0000000000000040"
                                                   "0000000000000000"
                                                   "0000000000000000"
                                                   "0000000000000000"},
  };
  for (const auto& c : cases) {
    const auto shape = DecodeGeometryBlob(Blob(c.header, c.wkb));
    EXPECT_EQ(shape.status().code(), absl::StatusCode::kDataLoss) << c.what;
  }
}

}  // namespace
}  // namespace hypermap::storage
