#include "map/edits/apply.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/edits/byte_size.h"
#include "map/frames/frame_bounds.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MakeSnapshot;
using testing::RandomSite;
using testing::Rng;
using testing::TestSeed;

SemanticObject Cup() { return {.label = "cup", .shape = Polygon::FromBox({{0, 0}, {1, 1}})}; }

LayerSpec Semantic(const std::string& name, const std::string& frame_id = "") {
  return {.name = name, .frame_id = frame_id};
}

LayerSpec Grid(const std::string& name) {
  return {
      .name = name, .kind = LayerKind::kOccupancy, .grid = GridGeometry{PlanarTransform(), 0.5}};
}

const SemanticLayer& SemanticOf(const Snapshot& snapshot, const std::string& name) {
  return *snapshot.FindSemantic(name);
}

TEST(ApplyTest, ABatchIsOneRevisionAndLeavesTheEarlierSnapshotAlone) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{Semantic("s")}}});
  const auto applied = Apply(before, {{PutObject{"s", Cup(), ""}, PutObject{"s", Cup(), ""}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(before.revision, 1);
  EXPECT_EQ(applied->snapshot->revision, 2);
  EXPECT_THAT(applied->object_ids, ElementsAre(1, 2));
  EXPECT_EQ(SemanticOf(before, "s").Size(), 0);
  EXPECT_EQ(SemanticOf(*applied->snapshot, "s").Size(), 2);
  EXPECT_EQ(applied->changes.size(), 2u);
}

TEST(ApplyTest, AliasesAreSetOneByOneAndFolded) {
  LayerSpec spec = Semantic("s");
  spec.aliases = {{"TV", {"TVmonitor"}}, {"seat", {"chair"}}};
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{spec}}});
  const auto applied = Apply(
      before, {{PutObject{"s", Cup(), ""}, SetAliases{"s", {{"Mug", {" CUP"}}, {"seat", {}}}}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  const SemanticLayer& after = SemanticOf(*applied->snapshot, "s");
  EXPECT_EQ(after.spec().aliases, (ValueAliases{{"mug", {"cup"}}, {"tv", {"tvmonitor"}}}));
  EXPECT_EQ(after.Size(), 1);
  EXPECT_EQ(SemanticOf(before, "s").spec().aliases,
            (ValueAliases{{"seat", {"chair"}}, {"tv", {"tvmonitor"}}}));
  const auto& change = std::get<AliasesSet>(applied->changes.front());
  EXPECT_EQ(change.before, (ValueAliases{{"seat", {"chair"}}}));
  EXPECT_EQ(change.after, (ValueAliases{{"mug", {"cup"}}}));
}

TEST(ApplyTest, AliasesThatABatchSetsTwiceChangeOnce) {
  LayerSpec spec = Semantic("s");
  spec.aliases = {{"seat", {"chair"}}};
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{spec}}});
  const auto applied = Apply(
      before, {{SetAliases{"s", {{"seat", {"bench"}}}}, SetAliases{"s", {{"mug", {"cup"}}}},
                SetAliases{"s", {{"seat", {}}}}, SetAliases{"s", {{"mug", {"cup", "beaker"}}}}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  ASSERT_EQ(applied->changes.size(), 1u);
  const auto& change = std::get<AliasesSet>(applied->changes.front());
  EXPECT_EQ(change.before, (ValueAliases{{"seat", {"chair"}}}));
  EXPECT_EQ(change.after, (ValueAliases{{"mug", {"cup", "beaker"}}}));
  EXPECT_EQ(SemanticOf(*applied->snapshot, "s").spec().aliases, change.after);
  // Aliases that become what they were are a change, too: the layer gets the version of its edit.
  const auto same = Apply(before, {{SetAliases{"s", {{"seat", {"chair"}}}}}});
  ASSERT_EQ(same->changes.size(), 1u);
  EXPECT_EQ(same->snapshot->LayerVersionOf("s"), 2);
}

TEST(ApplyTest, AliasesOfALayerMadeAnewAreItsOwn) {
  LayerSpec spec = Semantic("s");
  spec.aliases = {{"seat", {"chair"}}};
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{spec}}});
  const auto applied =
      Apply(before, {{SetAliases{"s", {{"mug", {"cup"}}}}, DeleteLayer{"s"},
                      CreateLayer{Semantic("s")}, SetAliases{"s", {{"tv", {"tvmonitor"}}}}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  ASSERT_EQ(applied->changes.size(), 3u);
  EXPECT_EQ(std::get<LayerDeleted>(applied->changes[0]).spec.aliases, spec.aliases);
  EXPECT_EQ(std::get<AliasesSet>(applied->changes[2]).before, ValueAliases());
  EXPECT_EQ(SemanticOf(*applied->snapshot, "s").spec().aliases,
            (ValueAliases{{"tv", {"tvmonitor"}}}));
}

TEST(ApplyTest, B2ManyAliasesCostWhatEachOfThemTakes) {
  constexpr int kAliases = 10'000;
  LayerSpec spec = Semantic("s");
  EditBatch batch;
  for (int i = 0; i < kAliases; ++i) {
    const std::string alias = absl::StrCat("alias ", i);
    spec.aliases.insert_or_assign(alias, {absl::StrCat("label ", i)});
    batch.edits.push_back(SetAliases{"s", {{alias, {absl::StrCat("other label ", i)}}}});
  }
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{spec}}});
  const auto applied = Apply(before, batch);
  ASSERT_TRUE(applied.ok()) << applied.status();
  int64_t bytes = 0;
  for (const Change& change : applied->changes) bytes += ByteSize(change);
  EXPECT_LT(bytes, 3 * UnsharedBytes(spec.aliases, {}));
  EXPECT_THAT(SemanticOf(*applied->snapshot, "s").spec().aliases.find("alias 77")->second,
              ElementsAre("other label 77"));
  // The number of labels is limited after each edit.
  EditBatch one_more{{SetAliases{"s", {{"alias 0", {}}}}, SetAliases{"s", {{"new", {"a"}}}},
                      SetAliases{"s", {{"newer", {"b"}}}}}};
  const absl::Status refused = Apply(before, one_more).status();
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("edits[2]: "));
}

TEST(ApplyTest, AnErrorNamesItsEditAndNothingIsDone) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{Semantic("s")}}});
  SemanticObject unlabelled = Cup();
  unlabelled.label = " ";
  const auto applied = Apply(before, {{PutObject{"s", Cup(), ""}, PutObject{"s", unlabelled, ""}}});
  EXPECT_EQ(applied.status().message(), "edits[1]: object.label is empty");
  EXPECT_EQ(SemanticOf(before, "s").Size(), 0);
}

TEST(ApplyTest, EveryWayToBeWrongHasItsCode) {
  const Snapshot before = MakeSnapshot(
      "m", {{CreateLayer{Semantic("s")}, CreateLayer{Grid("g")}, PutObject{"s", Cup(), ""}}});
  SemanticObject cup7 = Cup();
  cup7.id = 7;
  SemanticObject unsure = Cup();
  unsure.existence = 1.5;
  LayerSpec no_cells = Grid("x");
  no_cells.grid.reset();
  LayerSpec flat = Grid("x");
  flat.grid->resolution_m = 0;
  LayerSpec aliased_grid = Grid("x");
  aliased_grid.aliases = {{"tv", {"tvmonitor"}}};
  LayerSpec empty_alias = Semantic("x");
  empty_alias.aliases = {{"tv", {}}};
  const Polygon area = Polygon::FromBox({{0, 0}, {1, 1}});
  const struct {
    Edit edit;
    absl::StatusCode code;
  } cases[] = {
      {PutObject{"nope", Cup(), ""}, absl::StatusCode::kNotFound},
      {PutObject{"s", cup7, ""}, absl::StatusCode::kNotFound},
      {PutObject{"s", Cup(), "moon"}, absl::StatusCode::kNotFound},
      {PutObject{"g", Cup(), ""}, absl::StatusCode::kFailedPrecondition},
      {PutObject{"s", unsure, ""}, absl::StatusCode::kInvalidArgument},
      {SetAliases{"nope", {{"tv", {"tvmonitor"}}}}, absl::StatusCode::kNotFound},
      {SetAliases{"g", {{"tv", {"tvmonitor"}}}}, absl::StatusCode::kFailedPrecondition},
      {SetAliases{"s", {{"free", {"chair"}}}}, absl::StatusCode::kInvalidArgument},
      {CreateLayer{aliased_grid}, absl::StatusCode::kInvalidArgument},
      {CreateLayer{empty_alias}, absl::StatusCode::kInvalidArgument},
      {DeleteObject{"s", 9}, absl::StatusCode::kNotFound},
      {CreateLayer{Semantic("s")}, absl::StatusCode::kAlreadyExists},
      {CreateLayer{Semantic("../s")}, absl::StatusCode::kInvalidArgument},
      {CreateLayer{no_cells}, absl::StatusCode::kInvalidArgument},
      {CreateLayer{flat}, absl::StatusCode::kInvalidArgument},
      {DeleteLayer{"nope"}, absl::StatusCode::kNotFound},
      {SetTransform{{"map", "map", {}}}, absl::StatusCode::kInvalidArgument},
      {WriteCells{"s", {0, 1, 0, 1}, {1.0}}, absl::StatusCode::kFailedPrecondition},
      {WriteCells{"g", {0, 1, 0, 1}, {7.0}}, absl::StatusCode::kInvalidArgument},
      {FillPolygon{"g", area, "moon", CellRule::kCentre, 1.0}, absl::StatusCode::kNotFound},
      {FillPolygon{"g", area, "", CellRule::kCentre, 2.0}, absl::StatusCode::kInvalidArgument},
  };
  for (const auto& c : cases) {
    const auto applied = Apply(before, {{PutObject{"s", Cup(), ""}, c.edit}});
    EXPECT_EQ(applied.status().code(), c.code) << applied.status();
    EXPECT_THAT(std::string(applied.status().message()), HasSubstr("edits[1]: "));
  }
  EXPECT_EQ(Apply(before, {}).status().code(), absl::StatusCode::kInvalidArgument);
}

// The error of the last edit; the edits before it must be accepted.
absl::Status RefusalOf(const Snapshot& before, const EditBatch& batch) {
  EditBatch accepted = batch;
  accepted.edits.pop_back();
  if (!accepted.edits.empty()) {
    const absl::Status status = Apply(before, accepted).status();
    EXPECT_TRUE(status.ok()) << status;
  }
  return Apply(before, batch).status();
}

SemanticObject ObjectOf(const std::string& label, Shape shape) {
  return {.label = label, .shape = std::move(shape)};
}

TEST(ApplyTest, LayerTakesOnlyTheKindsOfShapeThatItNames) {
  LayerSpec lanes = Semantic("lanes");
  lanes.shape_kinds = {ShapeKind::kLineString};
  LayerSpec places = Semantic("places");
  places.shape_kinds = {ShapeKind::kPoint, ShapeKind::kPolygon};
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{lanes}, CreateLayer{places}, CreateLayer{Semantic("all")}}});
  const Shape line = *LineString::Make({{0, 0}, {1, 0}});
  const Shape point = *Shape::MakePoint({1, 2});
  const Shape area = Cup().shape;
  const std::map<std::string, std::vector<Shape>> taken = {
      {"lanes", {line}}, {"places", {point, area}}, {"all", {line, point, area}}};
  for (const auto& [layer, shapes] : taken) {
    for (const Shape& shape : {line, point, area}) {
      const auto applied = Apply(before, {{PutObject{layer, ObjectOf("thing", shape), ""}}});
      if (std::count(shapes.begin(), shapes.end(), shape)) {
        ASSERT_TRUE(applied.ok()) << applied.status();
        EXPECT_EQ(SemanticOf(*applied->snapshot, layer).Find(1)->shape, shape);
        continue;
      }
      EXPECT_EQ(applied.status(),
                absl::InvalidArgumentError(absl::StrCat("edits[0]: object.shape: layer \"", layer,
                                                        "\" takes no shapes of the kind ",
                                                        ShapeKindName(shape.kind()))));
    }
  }
}

TEST(ApplyTest, ObjectCannotChangeIntoAShapeThatItsLayerDoesNotTake) {
  LayerSpec lanes = Semantic("lanes");
  lanes.shape_kinds = {ShapeKind::kLineString};
  const Shape line = *LineString::Make({{0, 0}, {1, 0}});
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{lanes}, PutObject{"lanes", ObjectOf("lane", line), ""}}});
  SemanticObject reshaped = Cup();
  reshaped.id = 1;
  EXPECT_TRUE(
      absl::IsInvalidArgument(Apply(before, {{PutObject{"lanes", reshaped, ""}}}).status()));
  EXPECT_EQ(SemanticOf(before, "lanes").Find(1)->shape, line);
}

TEST(ApplyTest, LayerMustTakeAKindOfShapeAndOnlyLayersOfObjectsMayNameThem) {
  LayerSpec none = Semantic("none");
  none.shape_kinds = ShapeKinds({});
  LayerSpec grid = Grid("grid");
  grid.shape_kinds = {ShapeKind::kPoint};
  for (const LayerSpec& spec : {none, grid}) {
    const auto applied = Apply(Snapshot(), {{CreateLayer{spec}}});
    EXPECT_TRUE(absl::IsInvalidArgument(applied.status())) << applied.status();
    EXPECT_THAT(std::string(applied.status().message()), HasSubstr("shape_kinds"));
  }
}

TEST(ApplyTest, LinesAndPointsAreStoredInTheLayersFrame) {
  const Snapshot before = MakeSnapshot(
      "m", {{SetTransform{{"map", "dock", {10, 0, 0}}}, CreateLayer{Semantic("s", "dock")}}});
  const auto applied =
      Apply(before, {{PutObject{"s", ObjectOf("lane", *LineString::Make({{0, 0}, {1, 2}})), "map"},
                      PutObject{"s", ObjectOf("dock", *Shape::MakePoint({3, 4})), "map"}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  const SemanticLayer& layer = SemanticOf(*applied->snapshot, "s");
  EXPECT_EQ(layer.Find(1)->shape, Shape(*LineString::Make({{-10, 0}, {-9, 2}})));
  EXPECT_EQ(layer.Find(2)->shape, *Shape::MakePoint({-7, 4}));
}

TEST(ApplyTest, ObjectsAreStoredInTheLayersFrame) {
  const Snapshot before = MakeSnapshot(
      "m", {{SetTransform{{"map", "dock", {10, 0, 0}}}, CreateLayer{Semantic("s", "dock")}}});
  const auto applied = Apply(before, {{PutObject{"s", Cup(), "map"}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(SemanticOf(*applied->snapshot, "s").Find(1)->shape,
            Polygon::FromBox({{-10, 0}, {-9, 1}}));
}

TEST(ApplyTest, TransformsAndOriginsBeyondTheBoundOfCoordinatesAreRefused) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{Semantic("s")}}});
  const std::string words = "x or y is more than 1e+09 m";
  for (const PlanarTransform& far :
       {PlanarTransform(1e308, 1e308, 0.5), PlanarTransform(0, -1.001e9, 0)}) {
    EXPECT_EQ(RefusalOf(before, {{SetTransform{{"map", "half", far}}}}),
              absl::InvalidArgumentError("edits[0]: parent_from_child: " + words));
    LayerSpec grid = Grid("g");
    grid.grid->layer_from_grid = far;
    EXPECT_EQ(RefusalOf(before, {{CreateLayer{grid}}}),
              absl::InvalidArgumentError("edits[0]: layer.grid.origin: " + words));
  }
  EXPECT_TRUE(Apply(before, {{SetTransform{{"map", "a", {1e9, -1e9, 0.5}}}}}).ok());
}

TEST(ApplyTest, ShapesThatLeaveTheBoundInTheLayersFrameAreRefused) {
  const Snapshot before = MakeSnapshot(
      "m", {{CreateLayer{Semantic("s")}, SetTransform{{"map", "half", {1e9, 0, 0}}},
             SetTransform{{"half", "far", {1e9, 0, 0}}}, SetTransform{{"far", "off", {1, 0, 0}}}}});
  const Shape point = *Shape::MakePoint({1, 0});
  const auto put = [](const Shape& shape, const std::string& frame_id) {
    return EditBatch{{PutObject{"s", ObjectOf("thing", shape), frame_id}}};
  };
  EXPECT_EQ(RefusalOf(before, put(point, "half")),
            absl::InvalidArgumentError("edits[0]: object.shape: in frame \"map\": point is more "
                                       "than 1e+09 m from the origin"));
  EXPECT_EQ(RefusalOf(before, put(*LineString::Make({{-1, 0}, {1, 0}}), "half")),
            absl::InvalidArgumentError("edits[0]: object.shape: in frame \"map\": vertices[1] is "
                                       "more than 1e+09 m from the origin"));
  EXPECT_EQ(RefusalOf(before, put(Polygon::FromBox({{-1, 0}, {1, 1}}), "half")),
            absl::InvalidArgumentError("edits[0]: object.shape: in frame \"map\": outer[1] is "
                                       "more than 1e+09 m from the origin"));
  EXPECT_EQ(RefusalOf(before, put(point, "off")),
            absl::InvalidArgumentError("edits[0]: frames 'map' and 'off' are more than 2e+09 m "
                                       "apart"));
  const auto applied = Apply(before, put(*Shape::MakePoint({-1, 5}), "half"));
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(SemanticOf(*applied->snapshot, "s").Find(1)->shape, *Shape::MakePoint({1e9 - 1, 5}));
}

TEST(ApplyTest, ShapesThatRoundingTurnsOverAreRefused) {
  // Coordinates near 1e9 m are multiples of 1.2e-7 m.
  const Snapshot before = MakeSnapshot(
      "m", {{CreateLayer{Semantic("s")}, SetTransform{{"map", "far", {9e8, 9e8, 0}}}}});
  // An arrow whose edges cross when its vertices are rounded, and which then runs rightward.
  const double bit = 0x1p-23;
  const Polygon arrow = *Polygon::Make({{2.75 * bit, 2.91 * bit},
                                        {1.91 * bit, 1.45 * bit},
                                        {0.06 * bit, 0.85 * bit},
                                        {2.63 * bit, 1.58 * bit}});
  const absl::Status refused =
      RefusalOf(before, {{PutObject{"s", ObjectOf("thing", arrow), "far"}}});
  EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()),
              HasSubstr("edits[0]: object.shape: in frame \"map\": outer ring "));
  EXPECT_TRUE(Apply(before, {{PutObject{"s", ObjectOf("thing", arrow), ""}}}).ok());
}

TEST(ApplyTest, AreasThatAreMovedOutOfTheGridAreRefused) {
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{Grid("g")}, SetTransform{{"map", "half", {1e9, 1e9, 0.5}}},
                          SetTransform{{"half", "far", {1e9, 1e9, 0.5}}}}});
  const Polygon area = Polygon::FromBox({{-1e9, -1e9}, {1e9, 1e9}});
  for (const char* frame : {"", "half"}) {
    const absl::Status refused =
        RefusalOf(before, {{FillPolygon{"g", area, frame, CellRule::kCentre, 1.0}}});
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
    EXPECT_THAT(std::string(refused.message()), HasSubstr("edits[0]: area leaves the cells"));
  }
  const absl::Status refused =
      RefusalOf(before, {{FillPolygon{"g", area, "far", CellRule::kCentre, 1.0}}});
  EXPECT_THAT(std::string(refused.message()), HasSubstr("more than 2e+09 m apart"));
}

TEST(ApplyTest, DepthAndNumberOfFramesAreBoundedInABatch) {
  EditBatch chain, star;
  for (int i = 0; i < kMaxFrameDepth; ++i) {
    const std::string parent = i == 0 ? "" : absl::StrCat("f", i - 1);
    chain.edits.push_back(SetTransform{{parent, absl::StrCat("f", i), {}}});
  }
  chain.edits.push_back(SetTransform{{absl::StrCat("f", kMaxFrameDepth - 1), "deeper", {}}});
  const absl::Status too_deep = RefusalOf(Snapshot(), chain);
  EXPECT_TRUE(absl::IsResourceExhausted(too_deep)) << too_deep;
  EXPECT_THAT(std::string(too_deep.message()), HasSubstr("edits[256]: parent_frame_id: "));
  for (int64_t i = 0; i <= kMaxFrames; ++i) {
    star.edits.push_back(SetTransform{{"", absl::StrCat("f", i), {}}});
  }
  const absl::Status too_many = RefusalOf(Snapshot(), star);
  EXPECT_TRUE(absl::IsResourceExhausted(too_many)) << too_many;
  EXPECT_THAT(std::string(too_many.message()), HasSubstr("the most are 20000"));
}

TEST(ApplyTest, WhatABatchTouchesTwiceChangesOnce) {
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{Semantic("s")}, PutObject{"s", Cup(), ""}}});
  SemanticObject one = Cup();
  one.id = 1;
  one.label = "mug";
  const auto applied =
      Apply(before, {{PutObject{"s", one, ""}, DeleteObject{"s", 1}, PutObject{"s", Cup(), ""}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  ASSERT_EQ(applied->changes.size(), 2u);
  EXPECT_EQ(std::get<ObjectRemoved>(applied->changes[0]).before->label, "cup");
  EXPECT_EQ(std::get<ObjectPut>(applied->changes[1]).after->id, 2);
}

TEST(ApplyTest, IdsAreNeverUsedAgain) {
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{Semantic("s")}, PutObject{"s", Cup(), ""}}});
  const auto removed = Apply(before, {{DeleteObject{"s", 1}}});
  ASSERT_TRUE(removed.ok());
  const auto put = Apply(*removed->snapshot, {{PutObject{"s", Cup(), ""}}});
  ASSERT_TRUE(put.ok());
  EXPECT_THAT(put->object_ids, ElementsAre(2));
}

TEST(ApplyTest, RemovedObjectComesBackUnderItsIdOnlyWhenThatIsAskedFor) {
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{Semantic("s")}, PutObject{"s", Cup(), ""}}});
  const auto removed = Apply(before, {{DeleteObject{"s", 1}}});
  ASSERT_TRUE(removed.ok()) << removed.status();
  SemanticObject cup = Cup();
  cup.id = 1;
  EXPECT_TRUE(absl::IsNotFound(Apply(*removed->snapshot, {{PutObject{"s", cup, ""}}}).status()));
  const auto back = Apply(*removed->snapshot, {{PutObject{"s", cup, "", /*revive=*/true}}});
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(*SemanticOf(*back->snapshot, "s").Find(1), cup);
  // An id that was never assigned cannot be revived.
  cup.id = 2;
  EXPECT_TRUE(absl::IsNotFound(
      Apply(*removed->snapshot, {{PutObject{"s", cup, "", /*revive=*/true}}}).status()));
}

TEST(ApplyTest, ALayerCanBeMadeAnewInOneBatch) {
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{Semantic("s")}, PutObject{"s", Cup(), ""}}});
  const auto applied = Apply(before, {{PutObject{"s", Cup(), ""}, DeleteLayer{"s"},
                                       CreateLayer{Semantic("s")}, PutObject{"s", Cup(), ""}}});
  ASSERT_TRUE(applied.ok()) << applied.status();
  EXPECT_EQ(SemanticOf(*applied->snapshot, "s").Size(), 1);
  ASSERT_EQ(applied->changes.size(), 3u);
  EXPECT_TRUE(std::holds_alternative<LayerDeleted>(applied->changes[0]));
  EXPECT_TRUE(std::holds_alternative<LayerCreated>(applied->changes[1]));
  EXPECT_EQ(std::get<ObjectPut>(applied->changes[2]).after->id, 3);
}

// Changes are complete: applied to a plain model, they give the content of the snapshot.
TEST(ApplyTest, ChangesCarriedOutGiveTheSnapshot) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  Snapshot empty;
  const auto applied = Apply(empty, RandomSite(rng, 60));
  ASSERT_TRUE(applied.ok()) << applied.status();
  std::map<std::string, std::map<ObjectId, ObjectPtr>> objects;
  std::map<std::string, TileMap> tiles;
  std::map<std::string, CellBox> extents;
  for (const Change& change : applied->changes) {
    if (const auto* put = std::get_if<ObjectPut>(&change)) {
      objects[put->layer][put->after->id] = put->after;
    } else if (const auto* tile = std::get_if<TileWritten>(&change)) {
      tiles[tile->layer][tile->index] = tile->after;
    } else if (const auto* grown = std::get_if<ExtentGrown>(&change)) {
      extents[grown->layer] = grown->extent;
    }
  }
  for (const auto& [name, layer] : applied->snapshot->layers) {
    if (const auto* semantic = AsSemantic(layer.get())) {
      std::map<ObjectId, ObjectPtr> held;
      for (const ObjectPtr& object : semantic->Objects()) held[object->id] = object;
      EXPECT_EQ(objects[name], held);
    } else {
      const GridLayer& grid = *AsGrid(layer.get());
      EXPECT_EQ(tiles[name], grid.tiles());
      EXPECT_EQ(extents[name], grid.extent());
    }
  }
}

TEST(ApplyTest, ObjectsAndLayersHaveTheVersionOfTheirLastChange) {
  const Snapshot before = MakeSnapshot(
      "m", {{CreateLayer{Semantic("s")}, CreateLayer{Semantic("t")}, PutObject{"s", Cup(), ""}}});
  ASSERT_EQ(before.LayerVersionOf("s"), before.revision);
  SemanticObject cup = Cup();
  cup.id = 1;
  const auto put = Apply(before, {{PutObject{"s", cup, ""}}});
  ASSERT_TRUE(put.ok()) << put.status();
  const Snapshot& after = *put->snapshot;
  EXPECT_EQ(after.LayerVersionOf("s"), before.revision + 1);
  EXPECT_EQ(after.LayerVersionOf("t"), before.revision);
  EXPECT_EQ(after.LayerVersionOf("nope"), 0);
  const SemanticLayer& layer = SemanticOf(after, "s");
  EXPECT_EQ(layer.Find(1)->version, before.revision + 1);
}

TEST(ApplyTest, AStaleVersionAbortsTheBatch) {
  const Snapshot before =
      MakeSnapshot("m", {{CreateLayer{Semantic("s")}, PutObject{"s", Cup(), ""}}});
  const Revision version = before.revision;
  SemanticObject cup = Cup();
  cup.id = 1;
  PutObject put{"s", cup, ""};
  put.if_version = version;
  EXPECT_TRUE(Apply(before, {{put}}).ok());
  EXPECT_TRUE(Apply(before, {{put}, {{"s", version}}}).ok());
  EXPECT_TRUE(Apply(before, {{DeleteObject{"s", 1, version}}}).ok());

  put.if_version = version + 1;
  EXPECT_TRUE(absl::IsAborted(Apply(before, {{put}}).status()));
  EXPECT_TRUE(absl::IsAborted(Apply(before, {{DeleteObject{"s", 1, version - 1}}}).status()));
  EXPECT_TRUE(absl::IsAborted(Apply(before, {{DeleteObject{"s", 9, version}}}).status()));
  const auto stale_layer = Apply(before, {{PutObject{"s", cup, ""}}, {{"s", version + 1}}});
  EXPECT_TRUE(absl::IsAborted(stale_layer.status()));
  EXPECT_TRUE(absl::IsNotFound(Apply(before, {{PutObject{"s", cup, ""}}, {{"x", 1}}}).status()));
}

TEST(ApplyTest, TimeToLiveCountsFromTheBatch) {
  const Snapshot before = MakeSnapshot("m", {{CreateLayer{Semantic("s")}}});
  PutObject put{"s", Cup(), ""};
  put.time_to_live = absl::Seconds(5);
  const absl::Time now = absl::FromUnixSeconds(100);
  const auto applied = Apply(before, {{put}, {}, now});
  ASSERT_TRUE(applied.ok()) << applied.status();
  const SemanticLayer& layer = SemanticOf(*applied->snapshot, "s");
  EXPECT_EQ(layer.Find(1)->expires_at, now + absl::Seconds(5));
  put.time_to_live = absl::ZeroDuration();
  EXPECT_TRUE(absl::IsInvalidArgument(Apply(before, {{put}, {}, now}).status()));
}

}  // namespace
}  // namespace hypermap
