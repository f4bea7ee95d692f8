// Imports and exports are given up wherever their caller leaves.
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/cancellation/testing/cancelled_after.h"
#include "base/limits/limits.h"
#include "gtest/gtest.h"
#include "storage/interchange/geojson.h"
#include "storage/interchange/hmap.h"
#include "storage/interchange/hmap_config.h"
#include "storage/interchange/nav2.h"
#include "storage/interchange/pgm.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/semantic_objects.h"
#include "storage/interchange/shape_repair.h"
#include "storage/interchange/testing/archive.h"
#include "storage/interchange/testing/content.h"

namespace hypermap::storage {
namespace {

using testing::kOccupancyYaml;
using testing::MapOf;
using testing::OccupancyHmap;
using testing::SemanticHmap;

// A layer of polygons that cross themselves.
std::string BowTies(int n) {
  std::string yaml;
  for (int i = 0; i < n; ++i) {
    absl::StrAppend(&yaml, "- name: tie ", i, "\n  shape: POLYGON ((", i, " 0, ", i, ".5 1, ", i,
                    " 1, ", i, ".5 0, ", i, " 0))\n  tags: ~\n  confidence: ~\n");
  }
  return SemanticHmap(yaml);
}

GreyAlphaImage Chequered(int side) {
  GreyAlphaImage image{side, side, {}};
  for (int i = 0; i < side * side; ++i) {
    image.pixels.push_back({static_cast<uint8_t>(i * 7 % 255), 255});
  }
  return image;
}

std::string Features(int n) {
  std::string text = R"({"type":"FeatureCollection","features":[)";
  for (int i = 0; i < n; ++i) {
    absl::StrAppend(&text, i == 0 ? "" : ",",
                    R"({"type":"Feature","properties":{"label":"cup"},"geometry":{"type":"Point",)",
                    R"("coordinates":[)", i, ",0]}}");
  }
  return text + "]}";
}

TEST(InterchangeCancellationTest, A5_RepairOfAnHmapIsGivenUp) {
  const std::string archive = BowTies(100);
  EXPECT_GT(TimesCancelled([&] { return DecodeHmap(archive, Limits()).status(); }), 10);
}

TEST(InterchangeCancellationTest, ConfigsAreGivenUp) {
  std::string layers = "layers:\n";
  std::string transforms = "layers: []\ntransforms:\n";
  for (int i = 0; i < 200; ++i) {
    absl::StrAppend(&layers, "- {name: l", i, ", class: SemanticLayer}\n");
    absl::StrAppend(&transforms, "- {frame_id: map, child_frame_id: f", i,
                    ", transform_pose: [0, 0, 0]}\n");
  }
  for (const std::string& text : {layers, transforms}) {
    // Each of the 200 entries is a look.
    EXPECT_GT(TimesCancelled([&] {
                RepairLog repairs;
                return ParseHmapConfig(text, repairs).status();
              }),
              15);
  }
}

TEST(InterchangeCancellationTest, EntriesWithManyPartsAreGivenUp) {
  const auto take = [](const SemanticEntry& entry) {
    RepairLog repairs;
    const Limits limits;
    ImportTotals totals;
    return SemanticObjectReader("things", limits, totals, repairs).Take(entry);
  };
  SemanticEntry entry{"thing", "POLYGON((0 0,1 0,0 1))"};
  entry.tags.emplace(2000, " tag ");
  EXPECT_GT(TimesCancelled([&] { return take(entry); }), 20);
  std::string parts = "EMPTY";
  for (int i = 0; i < 2000; ++i) parts += ",EMPTY";
  EXPECT_GT(TimesCancelled([&] {
              return take({"thing", absl::StrCat("MULTIPOLYGON(", parts, ")")});
            }),
            20);
}

TEST(InterchangeCancellationTest, ManyFlatHolesAreGivenUp) {
  std::vector<Ring> rings(2001, {{5, 5}, {6, 6}});
  rings.front() = {{0, 0}, {9, 0}, {9, 9}, {0, 9}};
  EXPECT_GT(TimesCancelled([&] {
              int64_t crossings_left = 0;
              return RepairShape(rings, crossings_left).status();
            }),
            20);
}

TEST(InterchangeCancellationTest, A5_ImagesAreGivenUp) {
  const GreyAlphaImage image = Chequered(300);
  const std::string png = *EncodePng(image, PngChannels::kGreyAlpha);
  const std::string archive = OccupancyHmap(kOccupancyYaml, png);
  EXPECT_GT(TimesCancelled([&] { return DecodeHmap(archive, Limits()).status(); }), 10);
  EXPECT_GT(TimesCancelled([&] { return EncodePng(image, PngChannels::kGrey).status(); }), 10);
  const std::string pgm = EncodePgm(image);
  EXPECT_GT(TimesCancelled([&] { return DecodePgm(pgm, 1'000'000).status(); }), 1);
}

TEST(InterchangeCancellationTest, A5_GeoJsonIsGivenUp) {
  const std::string text = Features(2000);
  const auto decode = [&] { return DecodeGeoJson(text, "things", nullptr, Limits()); };
  EXPECT_GT(TimesCancelled([&] { return decode().status(); }), 10);
  const auto imported = decode();
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->batch.edits.size(), 2001u);
}

TEST(InterchangeCancellationTest, A5_ExportsAreGivenUp) {
  const Snapshot things = MapOf(*DecodeHmap(BowTies(100), Limits()));
  EXPECT_GT(TimesCancelled([&] { return EncodeHmap(things).status(); }), 10);
  EXPECT_GT(TimesCancelled([&] { return EncodeGeoJson(things, {}).status(); }), 10);
  const std::string png = *EncodePng(Chequered(300), PngChannels::kGreyAlpha);
  const Snapshot floor = MapOf(*DecodeHmap(OccupancyHmap(kOccupancyYaml, png), Limits()));
  const std::string layer = floor.layers.begin()->first;
  EXPECT_GT(TimesCancelled([&] { return EncodeHmap(floor).status(); }), 10);
  EXPECT_GT(TimesCancelled([&] { return EncodeNav2(floor, layer, Nav2Image::kPng).status(); }), 10);
}

}  // namespace
}  // namespace hypermap::storage
