#include "storage/conformance/testing/edited_map.h"

#include <memory>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"

namespace hypermap::storage {

MapHeader HeaderOf(const std::string& name) {
  return {name, "map", absl::FromUnixNanos(1'700'000'000'123'456'789), "create " + name};
}

Commit MakeCommit(const Snapshot& before, const EditBatch& batch, const std::string& request_id) {
  absl::StatusOr<AppliedBatch> applied = Apply(before, batch);
  EXPECT_TRUE(applied.ok()) << applied.status();
  Commit commit;
  if (applied.ok()) {
    auto next = std::make_shared<Snapshot>(*applied->snapshot);
    next->revision = before.revision + 1;
    applied->snapshot = std::move(next);
    commit.applied = *std::move(applied);
  }
  commit.author = "tester";
  commit.time = absl::FromUnixSeconds(1'700'000'000 + before.revision);
  commit.request_id = request_id;
  return commit;
}

void EditedMap::Edit(const EditBatch& batch, const std::string& request_id) {
  const Commit commit = MakeCommit(*snapshot, batch, request_id);
  const absl::Status status = stored->Write({commit});
  ASSERT_TRUE(status.ok()) << status;
  snapshot = commit.applied.snapshot;
}

EditedMap CreateMap(MapStore& store, const std::string& name) {
  absl::StatusOr<std::unique_ptr<StoredMap>> stored = store.Create(HeaderOf(name));
  EXPECT_TRUE(stored.ok()) << stored.status();
  if (!stored.ok()) return {};
  absl::StatusOr<SnapshotPtr> snapshot = (*stored)->Load();
  EXPECT_TRUE(snapshot.ok()) << snapshot.status();
  return {*std::move(stored), snapshot.ok() ? *snapshot : nullptr};
}

absl::Status DamageFoundByLoad(StoredMap& map) {
  const absl::StatusOr<SnapshotPtr> loaded = map.Load();
  return loaded.ok() ? (*loaded)->CheckUndamaged({}) : loaded.status();
}

LayerSpec SemanticSpec(const std::string& name) {
  LayerSpec spec;
  spec.name = name;
  spec.frame_id = "map";
  return spec;
}

LayerSpec GridSpec(const std::string& name, LayerKind kind, const PlanarTransform& origin,
                   double resolution_m) {
  LayerSpec spec = SemanticSpec(name);
  spec.kind = kind;
  spec.grid = GridGeometry{origin, resolution_m};
  return spec;
}

SemanticObject UnitSquare(const std::string& label) {
  SemanticObject object;
  object.label = label;
  object.shape = Polygon::FromBox({{0, 0}, {1, 1}});
  return object;
}

namespace {

void ExpectSameTiles(const GridLayer& actual, const GridLayer& expected) {
  EXPECT_EQ(actual.extent(), expected.extent());
  ASSERT_EQ(actual.tiles().size(), expected.tiles().size());
  for (const auto& [index, tile] : expected.tiles()) {
    const auto found = actual.tiles().find(index);
    ASSERT_NE(found, actual.tiles().end()) << "tile " << index.row << ", " << index.col;
    const TileCodes found_codes = found->second->codes();
    const TileCodes codes = tile->codes();
    int differences = 0;
    for (int i = 0; i < kCellsPerTile; ++i) {
      if (!SameCode(found_codes[i], codes[i])) ++differences;
    }
    EXPECT_EQ(differences, 0) << "tile " << index.row << ", " << index.col;
  }
}

void ExpectSameObjects(const SemanticLayer& actual, const SemanticLayer& expected) {
  const std::vector<ObjectPtr> objects = actual.Objects();
  const std::vector<ObjectPtr> expected_objects = expected.Objects();
  ASSERT_EQ(objects.size(), expected_objects.size());
  for (size_t i = 0; i < objects.size(); ++i) {
    EXPECT_TRUE(*objects[i] == *expected_objects[i]) << "object " << expected_objects[i]->id;
  }
}

}  // namespace

void ExpectSame(const Snapshot& actual, const Snapshot& expected) {
  EXPECT_EQ(actual.map_name, expected.map_name);
  EXPECT_EQ(actual.frame_id, expected.frame_id);
  EXPECT_EQ(actual.revision, expected.revision);
  EXPECT_EQ(actual.next_object_id, expected.next_object_id);
  EXPECT_EQ(actual.frames.transforms(), expected.frames.transforms());
  ASSERT_EQ(actual.layers.size(), expected.layers.size());
  for (const auto& [name, expected_layer] : expected.layers) {
    SCOPED_TRACE(name);
    const Layer* layer = actual.FindLayer(name);
    ASSERT_NE(layer, nullptr);
    EXPECT_TRUE(layer->spec() == expected_layer->spec());
    if (const auto* grid = AsGrid(expected_layer.get())) {
      ExpectSameTiles(dynamic_cast<const GridLayer&>(*layer), *grid);
    } else {
      ExpectSameObjects(dynamic_cast<const SemanticLayer&>(*layer),
                        dynamic_cast<const SemanticLayer&>(*expected_layer));
    }
  }
}

}  // namespace hypermap::storage
