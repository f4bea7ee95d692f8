#include "map/structure.h"

#include <gtest/gtest.h>

#include "map/edits/apply.h"

namespace hypermap {
namespace {

TEST(MapStructureTest, IsAMapWithoutContent) {
  Snapshot map;
  map.map_name = "m";
  LayerSpec floor{.name = "floor", .kind = LayerKind::kOccupancy, .frame_id = "map"};
  floor.grid = GridGeometry{PlanarTransform(), 0.5};
  const auto filled =
      Apply(map, {{CreateLayer{{.name = "things", .frame_id = "map"}}, CreateLayer{floor},
                   PutObject{"things", {.label = "cup", .shape = *Shape::MakePoint({1, 2})}},
                   WriteCells{"floor", {0, 1, 0, 2}, {0.5, 1.0}}}});
  ASSERT_TRUE(filled.ok()) << filled.status();

  const StructurePtr structure = StructureOf(*filled->snapshot);
  EXPECT_EQ(structure->revision, 1);
  ASSERT_EQ(structure->layers.size(), 2u);
  EXPECT_EQ(structure->FindLayer("floor")->extent, (CellBox{0, 1, 0, 2}));
  EXPECT_EQ(structure->FindLayer("things")->version, 1);
  EXPECT_EQ(structure->FindLayer("walls"), nullptr);
  EXPECT_TRUE(absl::IsNotFound(structure->SelectLayers({"floor", "walls"}).status()));
  EXPECT_EQ(structure->SelectLayers({"floor", "floor"})->size(), 1u);
  EXPECT_EQ(*structure->ResolveFrame(""), "map");
  EXPECT_TRUE(absl::IsNotFound(structure->ResolveFrame("moon").status()));

  const Snapshot empty = structure->EmptySnapshot();
  EXPECT_EQ(empty.revision, 1);
  EXPECT_EQ(empty.LayerVersionOf("things"), 1);
  EXPECT_EQ(empty.FindSemantic("things")->Size(), 0);
  EXPECT_EQ(empty.FindGrid("floor")->extent(), (CellBox{0, 1, 0, 2}));
  EXPECT_TRUE(empty.FindGrid("floor")->tiles().empty());
}

}  // namespace
}  // namespace hypermap
