#include "map/query/query.h"

#include <map>
#include <numbers>
#include <set>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/geometry/predicates.h"
#include "map/layers/grid/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using testing::MakeSnapshot;
using ::testing::Pair;
using testing::RandomPolygon;
using testing::RandomSite;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;
using ::testing::UnorderedElementsAre;

constexpr double kHalfTurn = std::numbers::pi;

// A map with a semantic layer in "map", a grid in "dock" (turned by 90 degrees, 10 m to the east),
// and a grid in a frame that is connected to nothing.
SnapshotPtr SmallSite() {
  const LayerSpec semantic{.name = "semantic", .frame_id = "map"};
  const LayerSpec grid{.name = "grid",
                       .kind = LayerKind::kOccupancy,
                       .frame_id = "dock",
                       .grid = GridGeometry{PlanarTransform(), 1.0}};
  LayerSpec adrift = grid;
  adrift.name = "adrift";
  adrift.frame_id = "raft";
  SemanticObject chair{.label = "chair", .polygon = Polygon::FromBox({{9, 1}, {10, 2}})};
  return std::make_shared<Snapshot>(MakeSnapshot(
      "site",
      {{SetTransform{{"map", "dock", PlanarTransform(10, 0, kHalfTurn / 2)}}, CreateLayer{semantic},
        CreateLayer{grid}, CreateLayer{adrift}, PutObject{"semantic", chair, ""},
        WriteCells{"grid", {0, 2, 0, 2}, {0.0, 0.9, std::nullopt, 1.0}}}}));
}

std::map<std::string, AnswerStatus> Statuses(const std::vector<LayerContent>& contents) {
  std::map<std::string, AnswerStatus> statuses;
  for (const LayerContent& c : contents) statuses[c.layer->spec().name] = c.content.status;
  return statuses;
}

TEST(ContentAtTest, EachLayerAnswersForItself) {
  const SnapshotPtr site = SmallSite();
  // (9.5, 1.5) in map is (1.5, 0.5) in dock: row 0, column 1.
  const auto contents = ContentAt(*site, {}, {9.5, 1.5});
  ASSERT_TRUE(contents.ok());
  EXPECT_THAT(Statuses(*contents),
              UnorderedElementsAre(Pair("semantic", AnswerStatus::kValue),
                                   Pair("grid", AnswerStatus::kValue),
                                   Pair("adrift", AnswerStatus::kNoTransform)));
  for (const LayerContent& c : *contents) {
    const bool is_grid = c.layer->spec().name == "grid";
    const bool is_semantic = c.layer->spec().name == "semantic";
    EXPECT_EQ(c.content.value, is_grid ? std::optional(0.9) : std::nullopt);
    EXPECT_EQ(c.content.objects.size(), is_semantic ? 1u : 0u);
  }
  const auto away = ContentAt(*site, {}, {8.5, 0.5});
  ASSERT_TRUE(away.ok());
  EXPECT_EQ(Statuses(*away)["grid"], AnswerStatus::kUnknown);
  const auto far = ContentAt(*site, {}, {100, 0});
  ASSERT_TRUE(far.ok());
  EXPECT_EQ(Statuses(*far)["grid"], AnswerStatus::kOutside);
}

TEST(ContentAtTest, SamePlaceInAnotherFrameIsTheSameContent) {
  const auto contents = ContentAt(*SmallSite(), {{"grid"}, "dock"}, {1.5, 0.5});
  ASSERT_TRUE(contents.ok());
  EXPECT_EQ((*contents)[0].content.value, 0.9);
  const auto adrift = ContentAt(*SmallSite(), {{"adrift"}, "raft"}, {1.5, 0.5});
  ASSERT_TRUE(adrift.ok());
  EXPECT_EQ((*adrift)[0].content.status, AnswerStatus::kOutside);
}

TEST(ContentAtTest, UnknownNamesAndPlacesAreErrors) {
  const SnapshotPtr site = SmallSite();
  EXPECT_EQ(ContentAt(*site, {{"nope"}, ""}, {0, 0}).status().message(),
            "map \"site\" has no layer \"nope\"");
  EXPECT_EQ(ContentAt(*site, {{}, "moon"}, {0, 0}).status().message(),
            "map \"site\" has no frame \"moon\"");
  EXPECT_EQ(ContentAt(*site, {}, {std::nan(""), 0}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

struct Collected {
  std::map<std::string, AnswerStatus> statuses;
  std::map<std::string, std::set<ObjectId>> objects;
  std::map<std::string, std::map<CellIndex, std::optional<double>>> cells;
};

Collected Collect(PartReader& reader, int max_items) {
  Collected all;
  while (!reader.done()) {
    const LayerPart part = reader.Next(max_items);
    const std::string& name = part.layer->spec().name;
    all.statuses[name] = part.status;
    for (const ObjectPtr& object : part.part.objects) all.objects[name].insert(object->id);
    for (const CellRun& run : part.part.runs) {
      for (int32_t c = run.col_begin; c < run.col_end; ++c) {
        all.cells[name][{run.row, c}] = run.value;
      }
    }
  }
  return all;
}

TEST(SearchTest, LayersThatCantTakeTheValueSaySo) {
  const auto occupied = Search(SmallSite(), {}, ValueKeyword::kOccupied, std::nullopt);
  ASSERT_TRUE(occupied.ok());
  const Collected all = Collect(**occupied, 100);
  EXPECT_THAT(all.statuses, ElementsAre(Pair("adrift", AnswerStatus::kNoTransform),
                                        Pair("grid", AnswerStatus::kValue),
                                        Pair("semantic", AnswerStatus::kUnsupportedValue)));
  EXPECT_EQ(all.cells.at("grid").size(), 2u);
}

TEST(NearestTest, MergesLayersAndTellsRefusals) {
  const auto answer = Nearest(*SmallSite(), {}, {10, 0}, ValueKeyword::kOccupied, 1);
  ASSERT_TRUE(answer.ok());
  ASSERT_EQ(answer->entries.size(), 1u);
  // Cell (row 0, column 1) of the dock has its centre at (1.5, 0.5) there: sqrt(2.5) m away.
  EXPECT_NEAR(answer->entries[0].neighbour.distance_m, std::sqrt(2.5), 1e-12);
  EXPECT_EQ(answer->refusals.size(), 2u);
  EXPECT_EQ(Nearest(*SmallSite(), {}, {0, 0}, ValueKeyword::kFree, 0).status().code(),
            absl::StatusCode::kInvalidArgument);
}

// Every question against a walk through all objects and cells, done in the layer's own frame.
TEST(QueryTest, EqualsBruteForceOnRandomSitesInEveryFrame) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const auto site = std::make_shared<Snapshot>(MakeSnapshot("site", RandomSite(rng, 200)));
  for (const std::string frame : {"", "map", "dock", "bench", "raft"}) {
    for (int i = 0; i < 5; ++i) {
      const Point p{Uniform(rng, -15, 15), Uniform(rng, -15, 15)};
      const Polygon area = RandomPolygon(rng, p, Uniform(rng, 0.5, 12));
      const auto reader = ContentIn(site, {{}, frame}, area);
      ASSERT_TRUE(reader.ok());
      const Collected all = Collect(**reader, UniformInt(rng, 1, 300));
      ASSERT_EQ(all.statuses.size(), site->layers.size());
      for (const auto& [name, layer] : site->layers) {
        const auto layer_from_caller =
            site->frames.Lookup(layer->spec().frame_id, frame.empty() ? "map" : frame);
        if (!layer_from_caller.ok()) {
          EXPECT_EQ(all.statuses.at(name), AnswerStatus::kNoTransform);
          continue;
        }
        EXPECT_EQ(all.statuses.at(name), AnswerStatus::kValue);
        const Polygon in_layer = *layer_from_caller * area;
        std::set<ObjectId> objects;
        std::map<CellIndex, std::optional<double>> cells;
        if (const auto* semantic = dynamic_cast<const SemanticLayer*>(layer.get())) {
          const PreparedPolygon prepared(in_layer);
          for (const ObjectPtr& object : semantic->Objects()) {
            if (prepared.Intersects(object->polygon)) objects.insert(object->id);
          }
        } else {
          const auto& grid = dynamic_cast<const GridLayer&>(*layer);
          const CellBox& e = grid.extent();
          for (int32_t r = e.row_begin; r < e.row_end; ++r) {
            for (int32_t c = e.col_begin; c < e.col_end; ++c) {
              if (Covers(in_layer, grid.geometry().CentreOf({r, c}))) {
                cells[{r, c}] = grid.ValueAt({r, c});
              }
            }
          }
        }
        const auto found = all.objects.find(name);
        EXPECT_EQ(found == all.objects.end() ? std::set<ObjectId>() : found->second, objects);
        const auto found_cells = all.cells.find(name);
        EXPECT_EQ(found_cells == all.cells.end() ? decltype(cells)() : found_cells->second, cells);
      }
    }
  }
}

TEST(GeometryInFrameTest, PutsCellsWhereTheLayerHasThem) {
  const GridGeometry in_layer{PlanarTransform(1, 2, 0.3), 0.5};
  const PlanarTransform caller_from_layer(4, 5, -1.2);
  const Point direct = caller_from_layer * in_layer.CentreOf({7, -3});
  const Point moved = GeometryInFrame(in_layer, caller_from_layer).CentreOf({7, -3});
  EXPECT_NEAR(direct.x, moved.x, 1e-12);
  EXPECT_NEAR(direct.y, moved.y, 1e-12);
}

}  // namespace
}  // namespace hypermap
