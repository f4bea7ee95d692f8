#include "wire/catalog.h"

#include <gtest/gtest.h>

#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"
#include "wire/layer.h"

namespace hypermap::wire {
namespace {

TEST(MapEntryOnTheWire, ComesBack) {
  const MapEntry office{
      "office", "map", 12, absl::FromUnixMillis(1'700'000'000'250), 3, "", 0xfedc'ba98'7654'3210};
  v1::Map message;
  EncodeMapEntry(office, &message);
  EXPECT_EQ(DecodeMapEntry(message), office);
}

TEST(MapEntryOnTheWire, OfAClosedMapHasOnlyTheProblem) {
  MapEntry broken;
  broken.name = "office";
  broken.state = MapState::kClosed;
  broken.problem = "DATA_LOSS: the file is damaged";
  v1::Map message;
  EncodeMapEntry(broken, &message);
  EXPECT_FALSE(message.has_create_time());
  EXPECT_EQ(DecodeMapEntry(message), broken);
}

TEST(MapEntryOnTheWire, StateComesBack) {
  for (const MapState state : kMapStates) {
    MapEntry entry;
    entry.state = state;
    v1::Map message;
    EncodeMapEntry(entry, &message);
    EXPECT_EQ(DecodeMapEntry(message).state, state);
  }
}

TEST(MapEntryOnTheWire, OlderServersTellAProblemOfClosedMapsOnly) {
  v1::Map message;
  EXPECT_EQ(DecodeMapEntry(message).state, MapState::kServing);
  message.set_problem("DATA_LOSS: the file is damaged");
  EXPECT_EQ(DecodeMapEntry(message).state, MapState::kClosed);
}

TEST(LayerEntryOnTheWire, ComesBackFromALayer) {
  LayerSpec spec;
  spec.name = "grid";
  spec.kind = LayerKind::kScalar;
  spec.frame_id = "map";
  spec.grid = GridGeometry{PlanarTransform(1.0, 2.0, 0.5), 0.25};
  spec.unit = "dBm";
  EditBatch batch;
  batch.edits.push_back(CreateLayer{spec});
  batch.edits.push_back(WriteCells{"grid", {-1, 1, 0, 3}, {1, 2, 3, 4, 5, 6}});
  const Snapshot snapshot = hypermap::testing::MakeSnapshot("site", batch);
  v1::Layer message;
  EncodeLayer(**snapshot.GetLayer("grid"), &message, 9);

  const auto entry = DecodeLayerEntry("layer", message);
  ASSERT_TRUE(entry.ok()) << entry.status();
  EXPECT_EQ(entry->spec, spec);
  EXPECT_EQ(entry->size, 6);
  EXPECT_EQ(entry->extent, (CellBox{-1, 1, 0, 3}));
  EXPECT_EQ(entry->version, 9);
  EXPECT_EQ(entry->properties, PropertiesOf(spec));

  EncodeLayer(*MakeEmptyLayer(spec), &message);
  message.clear_extent();
  EXPECT_EQ(DecodeLayerEntry("layer", message)->extent, std::nullopt);
}

TEST(RevisionRecordOnTheWire, ComesBack) {
  const RevisionRecord record{12, absl::FromUnixMillis(1'700'000'000'250), "cart", 3};
  v1::RevisionInfo message;
  EncodeRevisionRecord(record, &message);
  EXPECT_EQ(DecodeRevisionRecord(message), record);
}

}  // namespace
}  // namespace hypermap::wire
