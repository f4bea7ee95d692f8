// The memory that layers say they take.
#include <malloc.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::RandomCells;
using testing::RandomObject;
using testing::RandomPolygon;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

std::shared_ptr<const GridLayer> EmptyLayerOf(LayerKind kind) {
  return std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(
      {.name = "g", .kind = kind, .frame_id = "map", .grid = GridGeometry{{}, 0.1}}));
}

int64_t CountedAnew(const GridLayer& grid) {
  return GridLayer(grid.spec(), grid.shared_domain(), grid.tiles(), grid.extent()).ByteSize();
}

class ByteSizeTest : public ::testing::Test {
 protected:
  const uint64_t seed_ = TestSeed();
  Rng rng_{seed_};
  ::testing::ScopedTrace trace_{__FILE__, __LINE__, "HYPERMAP_TEST_SEED=" + std::to_string(seed_)};
};

TEST_F(ByteSizeTest, OfAGridFollowsItsTilesThroughAllEdits) {
  auto grid = EmptyLayerOf(LayerKind::kScalar);
  for (int i = 0; i < 60; ++i) {
    GridWriter writer(grid);
    for (int n = UniformInt(rng_, 1, 3); n > 0; --n) {
      const Point centre{Uniform(rng_, -30, 30), Uniform(rng_, -30, 30)};
      const std::optional<double> value =
          i % 4 == 3 ? std::nullopt : std::optional<double>(UniformInt(rng_, 0, 3));
      ASSERT_TRUE(writer
                      .Fill(RandomPolygon(rng_, centre, Uniform(rng_, 1, 40)), CellRule::kCentre,
                            value, 1 << 26)
                      .ok());
      const int32_t row = UniformInt(rng_, -300, 300);
      const CellBox box{row, row + UniformInt(rng_, 1, 40), 0, UniformInt(rng_, 1, 40)};
      ASSERT_TRUE(writer.Write(box, RandomCells(rng_, LayerKind::kScalar, box)).ok());
    }
    const int64_t before = grid->ByteSize();
    GridWriter::Result result = std::move(writer).Finish();
    EXPECT_EQ(result.layer->ByteSize(), CountedAnew(*result.layer));
    int64_t growth = 0;
    for (const auto& [index, tile] : result.written) {
      growth += BytesInGrid(tile.after.get()) - BytesInGrid(tile.before.get());
    }
    EXPECT_EQ(result.layer->ByteSize() - before, growth);
    grid = result.layer;
  }
}

TEST_F(ByteSizeTest, OfASemanticLayerFollowsItsObjectsAndAliasesThroughAllEdits) {
  auto layer = std::make_shared<const SemanticLayer>(LayerSpec{.name = "s", .frame_id = "map"});
  const int64_t empty = layer->ByteSize();
  for (int i = 0; i < 200; ++i) {
    absl::btree_map<ObjectId, ObjectPtr> changes;
    for (int n = UniformInt(rng_, 1, i % 10 == 0 ? 100 : 2); n > 0; --n) {
      const ObjectId id = UniformInt(rng_, 1, 300);
      auto object = std::make_shared<SemanticObject>(RandomObject(rng_, {0, 0}, 5));
      object->id = id;
      changes[id] = UniformInt(rng_, 0, 2) == 0 ? nullptr : std::move(object);
    }
    layer = layer->With(changes);
    ValueAliases aliases = layer->spec().aliases;
    const std::string alias = absl::StrCat("alias", UniformInt(rng_, 0, 20));
    if (i % 3 == 0) aliases.insert_or_assign(alias, {absl::StrCat("label", i), "chair"});
    if (i % 3 == 1) aliases.erase(alias);
    layer = layer->WithAliases(aliases);
    LayerSpec anew = layer->spec();
    anew.aliases = {};
    for (const auto& [word, labels] : layer->spec().aliases) {
      anew.aliases.insert_or_assign(word, labels);
    }
    ASSERT_EQ(layer->ByteSize(), SemanticLayer(anew, layer->Objects()).ByteSize());
  }
  absl::btree_map<ObjectId, ObjectPtr> removals;
  for (const ObjectPtr& object : layer->Objects()) removals[object->id] = nullptr;
  EXPECT_EQ(layer->With(removals)->WithAliases({})->ByteSize(), empty);
}

TEST_F(ByteSizeTest, OfAUniformTileIsSmall) {
  GridWriter writer(EmptyLayerOf(LayerKind::kOccupancy));
  ASSERT_TRUE(
      writer
          .Fill(Polygon::FromBox({{0, 0}, {10 * 12.8, 10 * 12.8}}), CellRule::kCentre, 0.5, 1 << 26)
          .ok());
  const auto grid = std::move(writer).Finish().layer;
  EXPECT_EQ(grid->tiles().size(), 100u);
  EXPECT_LT(grid->ByteSize(), 100 * 264 + 1024);
}

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define HYPERMAP_OTHER_ALLOCATOR
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HYPERMAP_OTHER_ALLOCATOR
#endif

#ifndef HYPERMAP_OTHER_ALLOCATOR

int64_t AllocatedBytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<int64_t>(info.uordblks + info.hblkhd);
}

// Compares what a layer says with what it has allocated.
void ExpectEnough(const std::string& name, const Layer& layer, int64_t allocated) {
  EXPECT_GE(layer.ByteSize(), allocated) << name;
  // Objects may have labels of their own, and a version of a grid is made beside the one before.
  EXPECT_LE(layer.ByteSize(), 4 * allocated) << name;
}

using MakeObject = std::function<SemanticObject(int)>;

SemanticObject PointOf(int i) {
  SemanticObject object;
  object.label = "cup";
  object.shape = Shape::MakePointUnchecked({i % 100 * 1.0, i / 100 * 1.0});
  return object;
}

SemanticObject SquareOf(int i) {
  SemanticObject object = PointOf(i);
  const Point p = object.shape.point();
  object.shape = Polygon::FromBox({p, {p.x + 0.5, p.y + 0.5}});
  return object;
}

TEST_F(ByteSizeTest, OfObjectsIsNotLessThanTheyAllocate) {
  const std::pair<const char*, MakeObject> kinds[] = {
      {"points", PointOf},
      {"points_with_labels_of_their_own",
       [](int i) {
         SemanticObject object = PointOf(i);
         object.label = absl::StrCat("label ", i);
         return object;
       }},
      {"squares", SquareOf},
      {"squares_with_tags_of_their_own",
       [](int i) {
         SemanticObject object = SquareOf(i);
         for (int t = 0; t < 8; ++t) object.tags.push_back(absl::StrCat("a longer tag ", i, t));
         return object;
       }},
      {"classes_and_attributes",
       [](int i) {
         SemanticObject object = SquareOf(i);
         for (int c = 0; c < 7; ++c) object.classes[absl::StrCat("class ", c)] = 0.5;
         for (int a = 0; a < 20; ++a) {
           object.attributes[absl::StrCat("attribute number ", a)] = std::string(i % 50, 'x');
         }
         return object;
       }},
      {"one_attribute",
       [](int i) {
         SemanticObject object = SquareOf(i);
         object.classes["a class with a long name"] = 0.5;
         object.attributes["key"] = int64_t{7};
         return object;
       }},
      {"holes", [](int i) {
         SemanticObject object = PointOf(i);
         const Point p = object.shape.point();
         const Box box{p, {p.x + 0.9, p.y + 0.9}};
         Rings rings = Polygon::FromBox(box).rings();
         for (int h = 0; h < 5; ++h) {
           const double y = p.y + 0.1 + 0.15 * h;
           rings.push_back({{p.x + 0.1, y}, {p.x + 0.1, y + 0.1}, {p.x + 0.2, y}});
         }
         object.shape = Polygon::MakeUnchecked(std::move(rings));
         return object;
       }}};
  for (const auto& [name, make] : kinds) {
    constexpr int kObjects = 5000;
    const int64_t before = AllocatedBytes();
    std::vector<ObjectPtr> objects;
    for (int i = 0; i < kObjects; ++i) {
      SemanticObject object = make(i);
      object.id = i + 1;
      objects.push_back(std::make_shared<const SemanticObject>(std::move(object)));
    }
    const SemanticLayer layer({.name = "s", .frame_id = "map"}, std::move(objects));
    objects = {};
    ExpectEnough(name, layer, AllocatedBytes() - before);
  }
}

TEST_F(ByteSizeTest, OfObjectsThatCameOneByOneIsNotLessThanTheyAllocate) {
  const int64_t before = AllocatedBytes();
  auto layer = std::make_shared<const SemanticLayer>(LayerSpec{.name = "s", .frame_id = "map"});
  for (int i = 0; i < 3000; ++i) {
    auto object = std::make_shared<SemanticObject>(SquareOf(i));
    object->id = i + 1;
    layer = layer->With({{object->id, std::move(object)}});
  }
  ExpectEnough("one_by_one", *layer, AllocatedBytes() - before);
}

TEST_F(ByteSizeTest, OfTilesIsNotLessThanTheyAllocate) {
  for (const bool uniform : {true, false}) {
    const int64_t before = AllocatedBytes();
    TileMap tiles;
    for (int i = 0; i < 400; ++i) {
      auto codes = std::make_unique<TileCodes>();
      codes->fill(static_cast<float>(i));
      if (!uniform) (*codes)[7] = 0.5F;
      tiles[{i / 20, i % 20}] = Tile::Make(*codes);
    }
    const auto empty = EmptyLayerOf(LayerKind::kScalar);
    const GridLayer grid(empty->spec(), empty->shared_domain(), std::move(tiles),
                         {0, 20 * kTileSide, 0, 20 * kTileSide});
    ExpectEnough(uniform ? "uniform" : "two_codes", grid, AllocatedBytes() - before);
  }
}

#endif  // HYPERMAP_OTHER_ALLOCATOR

}  // namespace
}  // namespace hypermap
