#include "map/query/query.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/geometry/predicates.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
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

// A map with a semantic layer in "map", a grid in "dock" (rotated by 90 degrees, 10 m to the east),
// and a grid in a frame without a transform.
SnapshotPtr SmallSite() {
  const LayerSpec semantic{.name = "semantic", .frame_id = "map"};
  const LayerSpec grid{.name = "grid",
                       .kind = LayerKind::kOccupancy,
                       .frame_id = "dock",
                       .grid = GridGeometry{PlanarTransform(), 1.0}};
  LayerSpec adrift = grid;
  adrift.name = "adrift";
  adrift.frame_id = "raft";
  SemanticObject chair{.label = "chair", .shape = Polygon::FromBox({{9, 1}, {10, 2}})};
  return std::make_shared<Snapshot>(MakeSnapshot(
      "site",
      {{SetTransform{{"map", "dock", PlanarTransform(10, 0, kHalfTurn / 2)}}, CreateLayer{semantic},
        CreateLayer{grid}, CreateLayer{adrift}, PutObject{"semantic", chair, ""},
        WriteCells{"grid", {0, 2, 0, 2}, {0.0, 0.9, std::nullopt, 1.0}}}}));
}

std::map<std::string, AnswerStatus> Statuses(const std::vector<LayerPointContent>& contents) {
  std::map<std::string, AnswerStatus> statuses;
  for (const LayerPointContent& c : contents) statuses[c.layer->spec().name] = c.content.status;
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
  for (const LayerPointContent& c : *contents) {
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

// A lane, a dock and a room in a layer whose frame is rotated by 90 degrees and 10 m to the east.
SnapshotPtr SiteOfShapes() {
  const auto put = [](const char* label, Shape shape) {
    return PutObject{"places", {.label = label, .shape = std::move(shape)}, ""};
  };
  return std::make_shared<Snapshot>(MakeSnapshot(
      "site",
      {{SetTransform{{"map", "dock", PlanarTransform(10, 0, kHalfTurn / 2)}},
        CreateLayer{{.name = "places", .frame_id = "dock"}},
        put("lane", *LineString::Make({{0, 0}, {5, 0}})), put("dock", *Shape::MakePoint({1, 2})),
        put("room", Polygon::FromBox({{0, 3}, {5, 5}}))}}));
}

std::vector<ObjectId> IdsAt(const Snapshot& site, const Scope& scope, const Point& p,
                            double tolerance_m) {
  const auto contents = ContentAt(site, scope, p, tolerance_m);
  EXPECT_TRUE(contents.ok()) << contents.status();
  std::vector<ObjectId> ids;
  for (const ObjectPtr& object : contents->front().content.objects) ids.push_back(object->id);
  return ids;
}

TEST(ContentAtTest, ToleranceIsADistanceInEveryFrame) {
  const SnapshotPtr site = SiteOfShapes();
  // (1, 1) in dock is (9, 1) in map: 1 m from the lane and from the dock, 2 m from the room.
  for (const auto& [frame, p] : {std::pair{"dock", Point{1, 1}}, std::pair{"map", Point{9, 1}}}) {
    SCOPED_TRACE(frame);
    const Scope scope{{"places"}, frame};
    EXPECT_THAT(IdsAt(*site, scope, p, 0.0), ElementsAre());
    EXPECT_THAT(IdsAt(*site, scope, p, 0.999), ElementsAre());
    EXPECT_THAT(IdsAt(*site, scope, p, 1.001), ElementsAre(1, 2));
    EXPECT_THAT(IdsAt(*site, scope, p, 2.001), ElementsAre(1, 2, 3));
  }
}

TEST(ContentAtTest, ToleranceDoesNotReachCells) {
  const SnapshotPtr site = SmallSite();
  const Scope grid{{"grid"}, "dock"};
  const auto outside = ContentAt(*site, grid, {-0.1, 0.5}, 5.0);
  ASSERT_TRUE(outside.ok()) << outside.status();
  EXPECT_EQ(outside->front().content.status, AnswerStatus::kOutside);
}

TEST(ContentAtTest, ToleranceMustBeANumberNotBelowZero) {
  const SnapshotPtr site = SiteOfShapes();
  for (const double bad : {-0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const absl::Status alone = ContentAt(*site, {}, {0, 0}, bad).status();
    EXPECT_EQ(alone.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(alone.message()), HasSubstr("tolerance_m"));
    EXPECT_EQ(PointsAsker::Make(site, {}, bad).status(), alone);
  }
}

TEST(PointsAskerTest, AnswersAsContentAtWithTheSameTolerance) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const auto site = std::make_shared<Snapshot>(MakeSnapshot("site", RandomSite(rng, 200)));
  std::vector<Point> points(200);
  for (Point& p : points) p = {Uniform(rng, -15, 15), Uniform(rng, -15, 15)};
  for (const double tolerance_m : {0.0, 0.05, 2.0}) {
    const Scope scope{{"semantic", "dock.objects"}, "bench"};
    auto asker = PointsAsker::Make(site, scope, tolerance_m);
    ASSERT_TRUE(asker.ok()) << asker.status();
    const auto answers = asker->ContentAtEach(points);
    ASSERT_TRUE(answers.ok()) << answers.status();
    for (size_t l = 0; l < scope.layers.size(); ++l) {
      std::vector<std::pair<size_t, ObjectId>> hits, expected;
      for (const auto& [point, object] : (*answers)[l].content.hits) {
        hits.emplace_back(point, object->id);
      }
      for (size_t i = 0; i < points.size(); ++i) {
        const Scope one{{scope.layers[l]}, scope.frame_id};
        for (const ObjectId id : IdsAt(*site, one, points[i], tolerance_m)) {
          expected.emplace_back(i, id);
        }
      }
      EXPECT_EQ(hits, expected) << scope.layers[l] << " with tolerance " << tolerance_m;
    }
  }
}

// A map whose transforms were stored before there was a bound of coordinates: "far" and what is
// below it can't be reached, "near" can. Layers are in "map", "near" and "far"; the grid "off" has
// its origin beyond the bound.
SnapshotPtr SiteFromBeforeTheBounds() {
  const auto put = [](const char* layer) {
    return PutObject{layer, {.label = "post", .shape = *Shape::MakePoint({1, 1})}, ""};
  };
  LayerSpec grid{.name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "far"};
  grid.grid = GridGeometry{PlanarTransform(), 1.0};
  LayerSpec off{.name = "off", .kind = LayerKind::kOccupancy, .frame_id = "map"};
  off.grid = GridGeometry{PlanarTransform(), 1.0};
  Snapshot site = MakeSnapshot(
      "site", {{SetTransform{{"map", "near", {5, 5, 0.5}}}, SetTransform{{"map", "half", {}}},
                SetTransform{{"half", "far", {}}}, CreateLayer{{.name = "own"}},
                CreateLayer{{.name = "next", .frame_id = "near"}},
                CreateLayer{{.name = "lost", .frame_id = "far"}}, CreateLayer{grid},
                CreateLayer{off}, put("own"), put("next"), put("lost"),
                WriteCells{"grid", {0, 2, 0, 2}, {0.0, 0.9, 0.9, 1.0}}}});
  EXPECT_TRUE(site.frames.Set({"map", "half", {1e308, 1e308, 0.5}}).ok());
  EXPECT_TRUE(site.frames.Set({"half", "far", {1e308, 1e308, 0.5}}).ok());
  off.grid->layer_from_grid = PlanarTransform(1.7e308, -1.7e308, 0.5);
  site.layers["off"] =
      std::make_shared<GridLayer>(off, MakeCellDomain(off), TileMap(), CellBox{0, 9, 0, 9});
  return std::make_shared<Snapshot>(std::move(site));
}

TEST(FarFramesTest, QuestionsThroughTransformsBeyondTheBoundHaveNoTransform) {
  const SnapshotPtr site = SiteFromBeforeTheBounds();
  const Polygon everywhere = Polygon::FromBox({{-1e9, -1e9}, {1e9, 1e9}});
  using Answers = std::map<std::string, AnswerStatus>;
  constexpr AnswerStatus kNo = AnswerStatus::kNoTransform, kYes = AnswerStatus::kValue;
  const std::pair<std::string, Answers> expected[] = {
      {"map", {{"own", kYes}, {"next", kYes}, {"lost", kNo}, {"grid", kNo}, {"off", kNo}}},
      {"near", {{"own", kYes}, {"next", kYes}, {"lost", kNo}, {"grid", kNo}, {"off", kNo}}},
      {"far", {{"own", kNo}, {"next", kNo}, {"lost", kYes}, {"grid", kYes}, {"off", kNo}}},
      {"half", {{"own", kNo}, {"next", kNo}, {"lost", kNo}, {"grid", kNo}, {"off", kNo}}},
  };
  for (const auto& [frame, answers] : expected) {
    SCOPED_TRACE(frame);
    const Scope scope{{}, frame};
    for (const auto& [layer, status] : answers) {
      const auto at = ContentAt(*site, {{layer}, frame}, {1, 1}, 1e9);
      ASSERT_TRUE(at.ok()) << at.status();
      EXPECT_EQ(at->front().content.status, status) << layer;
      auto asker = PointsAsker::Make(site, {{layer}, frame});
      ASSERT_TRUE(asker.ok()) << asker.status();
      EXPECT_EQ(asker->ContentAtEach({{1, 1}})->front().status, status) << layer;
    }
    const auto reader = ContentIn(site, scope, everywhere);
    ASSERT_TRUE(reader.ok()) << reader.status();
    while (!(*reader)->done()) {
      const LayerAnswerPart part = (*reader)->Next(100);
      EXPECT_EQ(part.status, answers.at(part.layer->spec().name)) << part.layer->spec().name;
    }
    const auto nearest = Nearest(*site, scope, {1, 1}, ValueLabel{"post"}, 9);
    ASSERT_TRUE(nearest.ok()) << nearest.status();
    for (const auto& entry : nearest->entries) {
      EXPECT_EQ(answers.at(entry.layer->spec().name), kYes);
      EXPECT_LT(entry.neighbour.distance_m, 100);
    }
    for (const auto& refusal : nearest->refusals) {
      EXPECT_TRUE(refusal.status == AnswerStatus::kUnsupportedValue ||
                  answers.at(refusal.layer) == kNo);
    }
  }
}

TEST(FarFramesTest, FarPointsHaveAnswersOfFiniteNumbers) {
  const SnapshotPtr site = SiteFromBeforeTheBounds();
  for (const Point& p : {Point{1.79e308, 1.79e308}, Point{-1.79e308, 1.79e308}, Point{1e300, 0}}) {
    for (const char* frame : {"map", "near"}) {
      const auto at = ContentAt(*site, {{}, frame}, p, 5.0);
      ASSERT_TRUE(at.ok());
      for (const LayerPointContent& content : *at) EXPECT_TRUE(content.content.objects.empty());
      auto asker = PointsAsker::Make(site, {{"own", "next"}, frame});
      ASSERT_TRUE(asker.ok());
      const auto answers = asker->ContentAtEach({&p, 1});
      ASSERT_TRUE(answers.ok());
      for (const LayerPointsContent& answer : *answers) EXPECT_TRUE(answer.content.hits.empty());
      const auto nearest = Nearest(*site, {{}, frame}, p, ValueLabel{"post"}, 9);
      ASSERT_TRUE(nearest.ok());
      EXPECT_EQ(nearest->entries.size(), 2u);
      for (const auto& entry : nearest->entries) {
        EXPECT_TRUE(std::isfinite(entry.neighbour.distance_m));
      }
    }
  }
}

// Layers of one frame: their number does not multiply the cost of finding the transform.
TEST(FarFramesTest, EachFrameIsLookedUpOnce) {
  EditBatch batch;
  std::string deepest = "map";
  for (int i = 0; i < 100; ++i) {
    const std::string child = "f" + std::to_string(i);
    batch.edits.push_back(SetTransform{{deepest, child, {0.1, 0, 0}}});
    deepest = child;
  }
  for (const char* frame : {"map", "f50", "f99"}) {
    for (int i = 0; i < 40; ++i) {
      batch.edits.push_back(
          CreateLayer{{.name = frame + ("-" + std::to_string(i)), .frame_id = frame}});
    }
  }
  const auto site = std::make_shared<Snapshot>(MakeSnapshot("site", batch));
  // Cancellation is checked once for each frame that is looked up, and once for each 32 layers that
  // are asked for their transforms and their content.
  const auto looks_of_point = [&](const Scope& scope) {
    const CancelledAfter never(1'000'000);
    EXPECT_TRUE(ContentAt(*site, scope, {0, 0}).ok());
    return never.num_looks();
  };
  const auto looks_of_batch = [&](const Scope& scope) {
    const CancelledAfter never(1'000'000);
    EXPECT_TRUE(PointsAsker::Make(site, scope).ok());
    return never.num_looks();
  };
  EXPECT_EQ(looks_of_point({{}, ""}), 2 + 2 * 120 / 32);
  EXPECT_EQ(looks_of_point({{}, "f99"}), 2 + 2 * 120 / 32);
  EXPECT_EQ(looks_of_point({{"map-1", "map-2"}, "f3"}), 1);
  EXPECT_EQ(looks_of_point({{"map-1", "map-2"}, ""}), 0);
  EXPECT_EQ(looks_of_batch({{}, ""}), 2 + 120 / 32);
  EXPECT_EQ(looks_of_batch({{}, "f99"}), 2 + 120 / 32);
  EXPECT_EQ(looks_of_batch({{"map-1", "map-2"}, "f3"}), 1);
  EXPECT_EQ(looks_of_batch({{"map-1", "map-2"}, ""}), 0);
}

TEST(FarFramesTest, QuestionsAreGivenUpBetweenFrames) {
  EditBatch batch;
  for (int i = 0; i < 50; ++i) {
    const std::string number = std::to_string(i);
    batch.edits.push_back(SetTransform{{"map", "f" + number, {1, 0, 0}}});
    batch.edits.push_back(CreateLayer{{.name = "l" + number, .frame_id = "f" + number}});
  }
  const auto site = std::make_shared<Snapshot>(MakeSnapshot("site", batch));
  const auto never_tell = [](const LayerPtr&, const PlanarTransform&, PointContent) {
    // The status is an error only if no content has been told.
    EXPECT_TRUE(Cancellation::Current()->status().ok());
  };
  EXPECT_GT(TimesCancelled([&] {
              return VisitContentAt(*site, {}, {0, 0}, 0.0, never_tell).status();
            }),
            5);
  EXPECT_GT(TimesCancelled([&] { return PointsAsker::Make(site, {}).status(); }), 5);
  EXPECT_GT(TimesCancelled([&] {
              return Nearest(*site, {}, {0, 0}, ValueLabel{"x"}, 1).status();
            }),
            5);
}

struct Collected {
  std::map<std::string, AnswerStatus> statuses;
  std::map<std::string, std::set<ObjectId>> objects;
  std::map<std::string, std::map<CellIndex, std::optional<double>>> cells;
};

Collected Collect(PartReader& reader, int max_items) {
  Collected all;
  while (!reader.done()) {
    const LayerAnswerPart part = reader.Next(max_items);
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

TEST(ContentTest, VisitsTellTheFrameOfTheCaller) {
  const auto ignore = [](const LayerPtr&, const PlanarTransform&, const PointContent&) {};
  EXPECT_EQ(*VisitContentAt(*SmallSite(), {}, {0, 0}, 0.0, ignore), "map");
  EXPECT_EQ(*VisitContentAt(*SmallSite(), {{"grid"}, "dock"}, {0, 0}, 0.0, ignore), "dock");
}

TEST(EmptyPartFilterTest, KeepsOneEmptyPartOfALayerWithoutMatches) {
  LayerAnswerPart empty;
  LayerAnswerPart match;
  match.part.objects.push_back(std::make_shared<SemanticObject>());
  const auto last = [](LayerAnswerPart part) {
    part.last = true;
    return part;
  };
  EmptyPartFilter filter;
  // A layer without matches.
  EXPECT_FALSE(filter.Keeps(empty));
  EXPECT_TRUE(filter.Keeps(last(empty)));
  // A layer with matches in two of its parts.
  EXPECT_FALSE(filter.Keeps(empty));
  EXPECT_TRUE(filter.Keeps(match));
  EXPECT_FALSE(filter.Keeps(empty));
  EXPECT_TRUE(filter.Keeps(match));
  EXPECT_FALSE(filter.Keeps(last(empty)));
  // A layer with one part.
  EXPECT_TRUE(filter.Keeps(last(match)));
  EXPECT_TRUE(filter.Keeps(last(empty)));
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
  // The centre of cell (row 0, column 1) is at (1.5, 0.5) in dock: sqrt(2.5) m away.
  EXPECT_NEAR(answer->entries[0].neighbour.distance_m, std::sqrt(2.5), 1e-12);
  EXPECT_EQ(answer->refusals.size(), 2u);
  EXPECT_EQ(Nearest(*SmallSite(), {}, {0, 0}, ValueKeyword::kFree, 0).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(NearestTest, MeasuresToLinesAndPoints) {
  const SnapshotPtr site = SiteOfShapes();
  const auto distance_to = [&](const char* label) {
    // (7, -2) in dock is 2 m past the end of the lane and 2 m beside it.
    const auto answer = Nearest(*site, {{}, "dock"}, {7, -2}, ValueLabel{label}, 1);
    EXPECT_TRUE(answer.ok()) << answer.status();
    return answer->entries.front().neighbour.distance_m;
  };
  EXPECT_DOUBLE_EQ(distance_to("lane"), std::sqrt(8.0));
  EXPECT_DOUBLE_EQ(distance_to("dock"), std::hypot(6, 4));
  EXPECT_DOUBLE_EQ(distance_to("room"), std::hypot(2, 5));
}

TEST(NearestTest, EqualsBruteForceOverShapesOfEveryKind) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const auto site = std::make_shared<Snapshot>(MakeSnapshot("site", RandomSite(rng, 300)));
  constexpr int kCount = 10;
  for (int i = 0; i < 50; ++i) {
    const Point p{Uniform(rng, -15, 15), Uniform(rng, -15, 15)};
    for (const std::string layer : {"semantic", "dock.objects"}) {
      const SemanticLayer& semantic = *site->FindSemantic(layer);
      const Point in_layer = *site->frames.Lookup(semantic.spec().frame_id, "map") * p;
      std::vector<std::pair<double, ObjectId>> expected, found;
      for (const ObjectPtr& object : semantic.Objects()) {
        if (object->label != "chair") continue;
        expected.emplace_back(Distance(object->shape, in_layer), object->id);
      }
      std::sort(expected.begin(), expected.end());
      if (expected.size() > kCount) expected.resize(kCount);
      const auto answer = Nearest(*site, {{layer}, "map"}, p, ValueLabel{"chair"}, kCount);
      ASSERT_TRUE(answer.ok()) << answer.status();
      for (const NearestNeighbours::Entry& entry : answer->entries) {
        found.emplace_back(entry.neighbour.distance_m, entry.neighbour.object->id);
      }
      EXPECT_EQ(found, expected) << layer;
    }
  }
}

// Compares every query with a scan of all objects and cells in the layer's own frame.
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
        if (const auto* semantic = AsSemantic(layer.get())) {
          const PreparedPolygon prepared(in_layer);
          for (const ObjectPtr& object : semantic->Objects()) {
            if (prepared.Intersects(object->shape)) objects.insert(object->id);
          }
        } else {
          const GridLayer& grid = *AsGrid(layer.get());
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
