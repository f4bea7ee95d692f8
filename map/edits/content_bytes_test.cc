// The memory of a map through its edits.
#include "map/content_bytes.h"

#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;
using testing::MakeSnapshot;
using testing::RandomEdits;
using testing::RandomSite;
using testing::Rng;
using testing::TestSeed;

LayerSpec GridOfMetres(const std::string& name) {
  LayerSpec spec{.name = name, .kind = LayerKind::kOccupancy, .frame_id = "map"};
  spec.grid = GridGeometry{PlanarTransform(), 1.0};
  return spec;
}

TEST(ContentBytesTest, GrowthIsTheDifferenceThroughAllEdits) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  Snapshot snapshot = MakeSnapshot("m", RandomSite(rng, 50));
  EXPECT_GT(ContentGrowth(Snapshot(), snapshot), 0);
  for (int i = 0; i < 60; ++i) {
    const auto applied = Apply(snapshot, RandomEdits(rng, snapshot));
    if (!applied.ok()) continue;
    const Snapshot& after = *applied->snapshot;
    ASSERT_EQ(ContentGrowth(snapshot, after), ContentBytes(after) - ContentBytes(snapshot));
    ASSERT_EQ(ContentGrowth(after, snapshot), -ContentGrowth(snapshot, after));
    snapshot = after;
  }
}

// Cells of a value, in a square of `tiles` x `tiles` tiles.
FillPolygon Fill(const std::string& layer, int tiles, std::optional<double> value) {
  const double side = kTileSide * static_cast<double>(tiles);
  return {layer, Polygon::FromBox({{0, 0}, {side, side}}), "", CellRule::kCentre, value};
}

// Cells of two values, in as many tiles.
FillPolygon FillHalf(const std::string& layer, int tiles) {
  FillPolygon fill = Fill(layer, tiles, 0.5);
  const double side = kTileSide * static_cast<double>(tiles);
  Ring ring{{0, 0}};
  // Each tile has an edge.
  for (int i = 0; i < tiles; ++i) {
    const double x = (i + 0.25) * kTileSide;
    ring.insert(ring.end(), {{x, 0}, {x, side - 1}, {x + 64, side - 1}, {x + 64, 0}});
  }
  ring.insert(ring.end(), {{side, 0}, {side, side}, {0, side}});
  fill.area = *Polygon::Make(ring);
  return fill;
}

// The store keeps the schema of the layer's tables, and the statements of an R*Tree. That the
// charge covers them is tested with the store (connection_memory_test.cc).
TEST(ContentBytesTest, EmptyLayersAreChargedForTheirTables) {
  const Snapshot empty;
  const LayerSpec things{.name = "things", .kind = LayerKind::kSemantic, .frame_id = "map"};
  const Snapshot semantic = MakeSnapshot("m", {{CreateLayer{things}}});
  EXPECT_GE(ContentGrowth(empty, semantic), 32 << 10);
  EXPECT_LT(ContentGrowth(empty, semantic), 38 << 10);
  const Snapshot grid = MakeSnapshot("m", {{CreateLayer{GridOfMetres("g")}}});
  EXPECT_GE(ContentGrowth(empty, grid), 8 << 10);
  EXPECT_LT(ContentGrowth(empty, grid), 10 << 10);
}

TEST(ContentBytesTest, BatchThatGrowsBeyondItsRoomIsRefusedByTheNameOfTheLimit) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{GridOfMetres("g")}}});
  const EditBatch batch{{FillHalf("g", 4)}};
  const auto applied = Apply(before, batch);
  ASSERT_TRUE(applied.ok()) << applied.status();
  const int64_t growth = ContentGrowth(before, *applied->snapshot);
  EXPECT_GT(growth, 16 * kCellsPerTile);
  EXPECT_TRUE(Apply(before, batch, {}, growth).ok());
  // Only the caller sees that the tiles which stay unpacked until the end are too many.
  const EditBatch large{{FillHalf("g", 32)}};
  const absl::Status refused = Apply(before, large, {}, growth).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("edits[0]: its cells take more than"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("--max_content_bytes"));
}

TEST(ContentBytesTest, RoomIsThatOfAllGridsOfTheBatchTogether) {
  const Snapshot before = MakeSnapshot(
      "m", {{CreateLayer{GridOfMetres("g")}, CreateLayer{GridOfMetres("h")}, FillHalf("g", 32)}});
  const EditBatch more{{FillHalf("h", 32)}};
  EXPECT_FALSE(Apply(before, more, {}, 1'000'000).ok());
  // The memory that another edit of the batch gives back can be used.
  EXPECT_TRUE(Apply(before, {{Fill("g", 32, 0.5), FillHalf("h", 32)}}, {}, 1'000'000).ok());
  EXPECT_TRUE(Apply(before, {{DeleteLayer{"g"}, FillHalf("h", 32)}}, {}, 1'000'000).ok());
  // But not beforehand.
  const absl::Status refused =
      Apply(before, {{FillHalf("h", 32), DeleteLayer{"g"}}}, {}, 1'000'000).status();
  EXPECT_THAT(std::string(refused.message()), HasSubstr("edits[0]: its cells take more than"));
}

}  // namespace
}  // namespace hypermap
