#include "storage/encoding/change_columns.h"

#include <memory>

#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

LayerSpec Layer() {
  LayerSpec spec;
  spec.name = "lanes";
  spec.frame_id = "map";
  return spec;
}

// Encodes a change of structure of the layer, and decodes it again.
absl::StatusOr<Change> Again(const Change& change) {
  const absl::StatusOr<ChangeColumns> columns = EncodeChange(change);
  if (!columns.ok()) return columns.status();
  EXPECT_FALSE(columns->object_id || columns->tile);
  return DecodeStructureChange(columns->kind, columns->detail.value_or(""), Layer());
}

TEST(ChangeColumnsTest, ChangesOfStructureComeBack) {
  LayerSpec spec = Layer();
  spec.aliases = {{"way", {"lane"}}};
  EXPECT_EQ(std::get<LayerCreated>(*Again(LayerCreated{spec})).spec, spec);
  EXPECT_EQ(std::get<LayerDeleted>(*Again(LayerDeleted{spec})).spec, spec);

  const FrameTransform transform = {"map", "odom", {1.5, -2, 0.1}};
  EXPECT_EQ(std::get<TransformSet>(*Again(TransformSet{transform})).transform, transform);

  const Change aliases = *Again(AliasesSet{"lanes", {{"way", {"lane"}}}, {}});
  EXPECT_EQ(std::get<AliasesSet>(aliases).layer, "lanes");
  EXPECT_EQ(std::get<AliasesSet>(aliases).before, (ValueAliases{{"way", {"lane"}}}));
  EXPECT_TRUE(std::get<AliasesSet>(aliases).after.empty());

  const Change grown = *Again(ExtentGrown{"lanes", {-1, 2, -3, 4}});
  EXPECT_EQ(std::get<ExtentGrown>(grown).layer, "lanes");
  EXPECT_EQ(std::get<ExtentGrown>(grown).extent, (CellBox{-1, 2, -3, 4}));
}

TEST(ChangeColumnsTest, HaveTheseTexts) {
  const struct {
    Change change;
    const char* kind;
    const char* detail;
  } cases[] = {
      {LayerCreated{Layer()}, "layer_created",
       R"({"free_below":0.196,"occupied_above":0.65,"unit":""})"},
      {LayerDeleted{Layer()}, "layer_deleted",
       R"({"free_below":0.196,"occupied_above":0.65,"unit":""})"},
      {TransformSet{{"map", "odom", {1.5, -2, 0.25}}}, "transform",
       R"({"child":"odom","parent":"map","x":1.5,"y":-2.0,"yaw":0.25})"},
      {AliasesSet{"lanes", {}, {{"way", {"lane"}}}}, "aliases",
       R"({"after":{"way":["lane"]},"before":{}})"},
      {ExtentGrown{"lanes", {-1, 2, -3, 4}}, "extent", "[-1,2,-3,4]"},
  };
  for (const auto& c : cases) {
    const ChangeColumns columns = *EncodeChange(c.change);
    EXPECT_STREQ(columns.kind, c.kind);
    EXPECT_EQ(columns.detail, c.detail);
  }
}

TEST(ChangeColumnsTest, ContentIsOnlyNamed) {
  auto object = std::make_shared<SemanticObject>();
  object->id = 7;
  const ChangeColumns put = *EncodeChange(ObjectPut{"lanes", nullptr, object});
  EXPECT_STREQ(put.kind, kObjectPut);
  EXPECT_EQ(put.object_id, 7);
  const ChangeColumns removed = *EncodeChange(ObjectRemoved{"lanes", object});
  EXPECT_STREQ(removed.kind, kObjectRemoved);
  EXPECT_EQ(removed.object_id, 7);
  const ChangeColumns tile = *EncodeChange(TileWritten{"grid", {-3, 4}, nullptr, nullptr});
  EXPECT_STREQ(tile.kind, kTileWritten);
  EXPECT_EQ(tile.tile, (TileIndex{-3, 4}));
  for (const ChangeColumns* columns : {&put, &removed, &tile}) EXPECT_FALSE(columns->detail);
}

TEST(ChangeColumnsTest, OtherColumnsAreDamage) {
  for (const auto& [kind, detail] : {std::pair{"transform", "{}"},
                                     {"aliases", "["},
                                     {"extent", "[1,2,3]"},
                                     {"layer_created", ""},
                                     {"put", "{}"},
                                     {"renamed", "{}"}}) {
    EXPECT_EQ(DecodeStructureChange(kind, detail, Layer()).status().code(),
              absl::StatusCode::kDataLoss)
        << kind;
  }
}

TEST(ChangeColumnsTest, TextThatIsNotUtf8IsRefused) {
  EXPECT_EQ(EncodeChange(AliasesSet{"lanes", {}, {{"\xff", {"lane"}}}}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace hypermap::storage
