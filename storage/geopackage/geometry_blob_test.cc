#include "storage/geopackage/geometry_blob.h"

#include <cmath>
#include <limits>

#include "absl/strings/escaping.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomPolygon;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;

// POLYGON ((0 0, 1 0, 1 1, 0 0)) as other programs write it, without an envelope.
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

std::string Blob(const std::string& header, const std::string& wkb) {
  return absl::HexStringToBytes(header + wkb);
}

TEST(GeometryBlobTest, IsTheBytesOfTheStandard) {
  const std::string blob = EncodeGeometryBlob(*Polygon::Make(kTriangle));
  EXPECT_EQ(absl::BytesToHexString(blob), std::string("47500003ffffffff"
                                                      "0000000000000000"
                                                      "000000000000f03f"
                                                      "0000000000000000"
                                                      "000000000000f03f") +
                                              kWkb);
}

TEST(GeometryBlobTest, RandomPolygonsComeBackAsTheyAre) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  for (int i = 0; i < 500; ++i) {
    const Point centre{testing::Uniform(rng, -1e5, 1e5), testing::Uniform(rng, -1e5, 1e5)};
    const Polygon polygon = RandomPolygon(rng, centre, std::pow(10, testing::Uniform(rng, -3, 3)));
    const std::string blob = EncodeGeometryBlob(polygon);
    const auto decoded = DecodeGeometryBlob(blob);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(*decoded, polygon);
    EXPECT_EQ(*BoxOfGeometryBlob(blob), polygon.bounds());
    // As it may be after a motion: no longer quite valid, and still as it was.
    const Polygon moved = testing::RandomTransform(rng, 1e6) * polygon;
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

TEST(GeometryBlobTest, EveryCutIsDamage) {
  const std::string blob = EncodeGeometryBlob(
      *Polygon::Make({{0, 0}, {9, 0}, {9, 9}, {0, 9}}, {{{1, 1}, {1, 2}, {2, 2}}}));
  for (size_t size = 0; size < blob.size(); ++size) {
    EXPECT_EQ(DecodeGeometryBlob(blob.substr(0, size)).status().code(),
              absl::StatusCode::kDataLoss);
  }
  EXPECT_EQ(DecodeGeometryBlob(blob + "x").status().code(), absl::StatusCode::kDataLoss);
}

TEST(GeometryBlobTest, HostileBlobsAreDamage) {
  const std::string point =
      "0101000000"
      "0000000000000000"
      "0000000000000000";
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
      {"a point", "47500001ffffffff", point},
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
    const auto polygon = DecodeGeometryBlob(Blob(c.header, c.wkb));
    EXPECT_EQ(polygon.status().code(), absl::StatusCode::kDataLoss) << c.what;
  }
}

}  // namespace
}  // namespace hypermap::storage
