// The content of maps comes back as it was written.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "map/edits/apply.h"
#include "map/layers/semantic_layer.h"
#include "storage/conformance/contract.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomCells;
using ::hypermap::testing::RandomObject;
using ::hypermap::testing::RandomShape;
using ::hypermap::testing::RandomSite;
using ::hypermap::testing::RandomTransform;
using ::hypermap::testing::Rng;
using ::hypermap::testing::Uniform;
using ::hypermap::testing::UniformInt;

class ContentContract : public MapContract {};

HYPERMAP_CONFORMANCE_SUITE(ContentContract);

TEST_P(ContentContract, NewMapIsEmptyAtRevisionZero) {
  EXPECT_EQ(map_.snapshot->revision, 0);
  EXPECT_EQ(map_.snapshot->next_object_id, 1);
  EXPECT_EQ(map_.snapshot->frame_id, "map");
  EXPECT_TRUE(map_.snapshot->layers.empty());
  const MapHeader& header = map_.stored->header();
  EXPECT_EQ(header.name, "site");
  EXPECT_EQ(header.created_at, HeaderOf("site").created_at);
  EXPECT_EQ(header.request_id, "create site");
  ExpectReopensTheSame();
}

TEST_P(ContentContract, RandomSitesReadBackAsTheyWereWritten) {
  Rng rng(seed_);
  map_.Edit(RandomSite(rng, 40));
  // Then edits of the existing content, in separate batches.
  for (int i = 0; i < 10; ++i) {
    EditBatch batch;
    const ObjectId id = UniformInt(rng, 1, 40);
    const auto& layer = dynamic_cast<const SemanticLayer&>(*map_.snapshot->FindLayer("semantic"));
    if (layer.Find(id) != nullptr) {
      SemanticObject object = RandomObject(rng, {3, -2}, 1.5);
      object.id = id;
      batch.edits.push_back(PutObject{"semantic", object, "dock"});
    }
    if (const ObjectId other = UniformInt(rng, 1, 40); other != id && layer.Find(other)) {
      batch.edits.push_back(DeleteObject{"semantic", other});
    }
    const CellBox box{-200 + i, -190 + i, 100, 140};
    batch.edits.push_back(WriteCells{"wifi", box, RandomCells(rng, LayerKind::kScalar, box)});
    batch.edits.push_back(
        SetTransform{{"dock", "bench", ::hypermap::testing::RandomTransform(rng, 9)}});
    map_.Edit(batch);
  }
  ExpectReopensTheSame();
}

TEST_P(ContentContract, AliasesComeBackAsTheyWereLeft) {
  LayerSpec spec = SemanticSpec("things");
  spec.aliases = {{"fernseher", {"tvmonitor"}}, {"möbel", {"chair", "dining table"}}};
  map_.Edit({{CreateLayer{spec}, CreateLayer{SemanticSpec("other")}}});
  map_.Edit({{SetAliases{"things", {{"fernseher", {}}, {"sofa", {"couch"}}}},
              SetAliases{"other", {{"a", {"b"}}}}}});
  EXPECT_EQ(map_.snapshot->FindLayer("things")->spec().aliases,
            (ValueAliases{{"möbel", {"chair", "dining table"}}, {"sofa", {"couch"}}}));
  ExpectReopensTheSame();
}

TEST_P(ContentContract, KindsOfShapeThatALayerTakesComeBack) {
  const std::vector<ShapeKinds> sets = {{ShapeKind::kPolygon},
                                        {ShapeKind::kLineString},
                                        {ShapeKind::kPoint},
                                        {ShapeKind::kPolygon, ShapeKind::kLineString},
                                        {ShapeKind::kPolygon, ShapeKind::kPoint},
                                        {ShapeKind::kLineString, ShapeKind::kPoint},
                                        ShapeKinds()};
  EditBatch batch;
  for (size_t i = 0; i < sets.size(); ++i) {
    LayerSpec spec = SemanticSpec(absl::StrCat("layer", i));
    spec.shape_kinds = sets[i];
    batch.edits.push_back(CreateLayer{spec});
  }
  map_.Edit(batch);
  // A change of the layer's other parameters keeps them.
  map_.Edit({{SetAliases{"layer1", {{"path", {"lane"}}}}, DeleteLayer{"layer2"}}});
  const auto history = map_.stored->OpenHistory();
  ASSERT_TRUE(history.ok()) << history.status();
  for (const Revision revision : {1, 2}) {
    const StructurePtr past = (*(*history)->At(revision))->structure();
    for (size_t i = 0; i < sets.size(); ++i) {
      if (revision == 2 && i == 2) continue;
      const LayerStructure* layer = past->FindLayer(absl::StrCat("layer", i));
      ASSERT_NE(layer, nullptr);
      EXPECT_EQ(layer->spec.shape_kinds, sets[i]) << i;
    }
  }
  const auto commits = (*history)->Commits(1, 100);
  ASSERT_TRUE(commits.ok()) << commits.status();
  bool deletes_points = false;
  for (const Change& change : commits->front().changes) {
    const auto* deleted = std::get_if<LayerDeleted>(&change);
    if (deleted != nullptr) deletes_points = deleted->spec.shape_kinds == sets[2];
  }
  EXPECT_TRUE(deletes_points);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, GridValuesOfAllKindsComeBackBitForBit) {
  const PlanarTransform turned(-15.4, 12.25, 0.75 * std::numbers::pi);
  EditBatch batch;
  batch.edits.push_back(CreateLayer{GridSpec("p", LayerKind::kOccupancy, turned, 0.05)});
  batch.edits.push_back(CreateLayer{GridSpec("e", LayerKind::kExploration, {}, 1e-4)});
  batch.edits.push_back(CreateLayer{GridSpec("f", LayerKind::kScalar, {1e6, -1e6, 0}, 1e4)});
  std::vector<std::optional<double>> all(10002);
  for (int i = 0; i <= 10000; ++i) all[i] = i / 10000.0;
  batch.edits.push_back(WriteCells{"p", {-3, -2, -5000, 5002}, all});
  batch.edits.push_back(WriteCells{"e", {0, 1, 0, 3}, {0.0, std::nullopt, 1.0}});
  using Float = std::numeric_limits<float>;
  batch.edits.push_back(WriteCells{"f",
                                   {-1, 0, -4, 4},
                                   {Float::max(), Float::lowest(), Float::denorm_min(), -0.0,
                                    Float::min(), std::nullopt, 1.0f / 3, -63.5}});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, CellsAtTheEndsOfTheMatrixAreStored) {
  EditBatch batch;
  batch.edits.push_back(CreateLayer{GridSpec("far", LayerKind::kOccupancy, {}, 0.05)});
  const int32_t end = kMaxCellIndex;
  batch.edits.push_back(WriteCells{"far", {-end, -end + 1, -end, -end + 2}, {0.25, 0.5}});
  batch.edits.push_back(WriteCells{"far", {end - 1, end, end - 2, end}, {0.75, 1.0}});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, ObjectsKeepEverything) {
  SemanticObject object = UnitSquare("Küchentisch – 食卓 'quoted' \"twice\"; DROP TABLE");
  object.shape = *Polygon::Make({{0.1, 0.2}, {10.3, 0.4}, {9, 9.7}, {1e-9, 8}},
                                {{{2, 2}, {2, 3}, {3, 3}}, {{5, 5}, {5, 6}, {6.5, 6}}});
  object.existence = 0.1 + 0.2;
  object.classes = {{"chair", 1.0 / 3}, {"Stuhl", 0}, {"x", 1}};
  object.tags = {"b", "a", "b", "ÄÖ"};
  object.height = HeightRange{-0.5, 0.1 + 0.7};
  object.attributes = {{"yes", true},
                       {"no", false},
                       {"whole", int64_t{7}},
                       {"whole double", 7.0},
                       {"least", std::numeric_limits<int64_t>::min()},
                       {"most", std::numeric_limits<int64_t>::max()},
                       {"tiny", std::numeric_limits<double>::denorm_min()},
                       {"huge", -std::numeric_limits<double>::max()},
                       {"text", std::string("line\nand \x01 and 🤖")},
                       {"empty", std::string()}};
  EditBatch batch;
  batch.edits.push_back(CreateLayer{SemanticSpec("s")});
  batch.edits.push_back(PutObject{"s", object, ""});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, LayersOfAwkwardNamesStandBesideEachOther) {
  EditBatch batch;
  for (const char* name : {"a-b", "a.b", "a_b", "A_B", "gpkg_contents", "hypermap_layers",
                           "rtree_a_b_geom", "sqlite_x", "select", "0", "layer_0", "a_b_2"}) {
    batch.edits.push_back(CreateLayer{SemanticSpec(name)});
    SemanticObject object = UnitSquare(name);
    batch.edits.push_back(PutObject{name, object, ""});
  }
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, LayerIsDeletedAndMadeAgainAsAnotherKind) {
  EditBatch make;
  make.edits.push_back(CreateLayer{SemanticSpec("x")});
  make.edits.push_back(PutObject{"x", UnitSquare("chair"), ""});
  map_.Edit(make);
  EditBatch remake;
  remake.edits.push_back(DeleteLayer{"x"});
  remake.edits.push_back(CreateLayer{GridSpec("x", LayerKind::kExploration, {}, 0.5)});
  remake.edits.push_back(WriteCells{"x", {0, 1, 0, 1}, {1.0}});
  map_.Edit(remake);
  EditBatch again;
  again.edits.push_back(DeleteLayer{"x"});
  again.edits.push_back(CreateLayer{SemanticSpec("x")});
  map_.Edit(again);
  ExpectReopensTheSame();
}

// Shapes of the size of the rounding error, in frames near the bound of coordinates.
TEST_P(ContentContract, EveryShapeThatIsAcceptedInAFarFrameComesBack) {
  Rng rng(seed_);
  EditBatch frames{{CreateLayer{SemanticSpec("s")}}};
  for (int i = 0; i < 20; ++i) {
    frames.edits.push_back(SetTransform{{"", absl::StrCat("far", i), RandomTransform(rng, 1e9)}});
  }
  map_.Edit(frames);
  EditBatch accepted;
  for (int i = 0; i < 600; ++i) {
    const double size_m = std::pow(10.0, Uniform(rng, -8, -5));
    SemanticObject object = UnitSquare("tiny");
    object.shape = RandomShape(rng, {Uniform(rng, -9, 9), 0}, size_m);
    if (i % 2 == 0) {
      Ring ring(4);
      for (Point& p : ring) p = {Uniform(rng, 0, size_m), Uniform(rng, 0, size_m)};
      if (auto polygon = Polygon::Make(std::move(ring)); polygon.ok()) object.shape = *polygon;
    }
    const Edit put = PutObject{"s", object, absl::StrCat("far", i % 20)};
    const absl::Status status = Apply(*map_.snapshot, {{put}}).status();
    EXPECT_TRUE(status.ok() || absl::IsInvalidArgument(status)) << status;
    if (status.ok()) accepted.edits.push_back(put);
  }
  EXPECT_GT(accepted.edits.size(), 100u);
  map_.Edit(accepted);
  ExpectReopensTheSame();
}

const char* const kAwkwardTexts[] = {"it's",          "\"twice\"",      "100%_",
                                     "back\\slash\\", "$1 ?1 :a @b",    "{[(<,;>)]}",
                                     "NULL",          "\u00e9 e\u0301", "\U0001f916\U0010fffd",
                                     "\ufeffbom",     " spaces ",       "x"};

TEST_P(ContentContract, TextsComeBackToTheByte) {
  LayerSpec wifi = GridSpec("wifi", LayerKind::kScalar, {}, 0.05);
  wifi.unit = "'\"%\\ \U0001f916";
  LayerSpec things = SemanticSpec("things");
  for (const char* text : kAwkwardTexts) things.aliases.insert_or_assign(text, {text, "chair"});
  EditBatch batch{{CreateLayer{wifi}, CreateLayer{things}}};
  for (const char* text : kAwkwardTexts) {
    SemanticObject object = UnitSquare(text);
    object.classes = {{text, 0.5}};
    object.tags = {text, text};
    object.attributes = {{text, std::string(text)}, {"more", absl::StrCat("\n\t\r\x01\x7f", text)}};
    batch.edits.push_back(PutObject{"things", object, ""});
  }
  SemanticObject large = UnitSquare(std::string(1000, 'l'));
  large.attributes = {{"text", std::string(1 << 20, '"')}};
  batch.edits.push_back(PutObject{"things", large, ""});
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, CoordinatesOfAllSizesComeBackAndAreFoundInThePast) {
  constexpr double kFar = 1e9;
  const Point points[] = {{kFar, -kFar},
                          {-kFar, std::nextafter(kFar, 0)},
                          {1e-300, -1e-300},
                          {std::numeric_limits<double>::denorm_min(), 0},
                          {-0.0, 0.0},
                          {0.1 + 0.2, -1.0 / 3},
                          {123456789.123456789, -987654321.98765432}};
  EditBatch batch{{CreateLayer{SemanticSpec("s")}}};
  for (const Point& point : points) {
    SemanticObject object = UnitSquare("point");
    object.shape = *Shape::MakePoint(point);
    batch.edits.push_back(PutObject{"s", object, ""});
    object.shape = LineString::MakeUnchecked({point, {0.5, 0.5}});
    batch.edits.push_back(PutObject{"s", object, ""});
  }
  batch.edits.push_back(SetTransform{{"map", "far", {kFar, -kFar, std::numbers::pi}}});
  batch.edits.push_back(SetTransform{{"map", "near", {1e-300, -0.0, -1e-300}}});
  map_.Edit(batch);
  map_.Edit({{DeleteLayer{"s"}}});
  const auto reader = map_.stored->OpenHistory();
  ASSERT_TRUE(reader.ok()) << reader.status();
  const auto past = (*reader)->At(1);
  ASSERT_TRUE(past.ok()) << past.status();
  EXPECT_EQ((*past)->Objects("s")->size(), 2 * std::size(points));
  ObjectId id = 0;
  for (const Point& point : points) {
    const auto found = (*past)->Objects("s", Box{point, point});
    ASSERT_TRUE(found.ok()) << found.status();
    for (const ObjectId expected : {++id, ++id}) {
      EXPECT_TRUE(std::any_of(found->begin(), found->end(),
                              [&](const ObjectPtr& object) { return object->id == expected; }))
          << "object " << expected;
    }
  }
  // Boxes beyond all coordinates contain all.
  const double most = std::numeric_limits<double>::max();
  EXPECT_EQ((*past)->Objects("s", Box{{-most, -most}, {most, most}})->size(),
            2 * std::size(points));
  EXPECT_TRUE((*past)->Objects("s", Box{{5e8, 5e8}, {6e8, 6e8}}).ok());
  ExpectReopensTheSame();
}

TEST_P(ContentContract, ParametersOfLayersComeBack) {
  LayerSpec occupancy = GridSpec("o", LayerKind::kOccupancy, {-1e6, 1e-9, -3}, 0.05);
  occupancy.thresholds = {0.1 + 0.2, 0.7};
  EditBatch batch{{CreateLayer{occupancy}}};
  for (const CellRule rule : {CellRule::kCentre, CellRule::kCovered, CellRule::kTouched}) {
    LayerSpec spec =
        GridSpec(absl::StrCat("e-", CellRuleName(rule)), LayerKind::kExploration, {}, 1.0 / 3);
    spec.explored_rule = rule;
    spec.frame_id = "base/link";
    batch.edits.push_back(CreateLayer{spec});
  }
  const std::string longest(kMaxNameLength - 1, 'n');
  for (const char* end : {"a", "b"}) {
    batch.edits.push_back(CreateLayer{SemanticSpec(longest + end)});
    batch.edits.push_back(PutObject{longest + end, UnitSquare(end), ""});
  }
  map_.Edit(batch);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, TimesOfExpiryComeBack) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}}});
  for (const int64_t nanos :
       {std::numeric_limits<int64_t>::min() / 2, int64_t{-2}, int64_t{-1}, int64_t{0},
        int64_t{1'700'000'000'123'456'789}, std::numeric_limits<int64_t>::max() - 1}) {
    EditBatch batch{{PutObject{"s", UnitSquare("passing"), ""}}};
    std::get<PutObject>(batch.edits.front()).time_to_live = absl::Nanoseconds(1);
    batch.time = absl::FromUnixNanos(nanos);
    map_.Edit(batch);
  }
  EXPECT_EQ(map_.snapshot->FindSemantic("s")->Find(2)->expires_at, absl::FromUnixNanos(-1));
  ExpectReopensTheSame();
}

TEST_P(ContentContract, ManyObjectsArePutReplacedAndRemovedInOneCommitEach) {
  constexpr int kCount = 3000;
  EditBatch put{{CreateLayer{SemanticSpec("s")}}};
  EditBatch replace;
  EditBatch remove;
  for (ObjectId id = 1; id <= kCount; ++id) {
    SemanticObject object = UnitSquare(absl::StrCat("object ", id));
    put.edits.push_back(PutObject{"s", object, ""});
    object.id = id;
    object.shape = Polygon::FromBox({{1.0 * id, 0}, {id + 1.0, 1}});
    replace.edits.push_back(PutObject{"s", object, ""});
    if (id % 3 != 0) remove.edits.push_back(DeleteObject{"s", id});
  }
  for (const EditBatch& batch : {put, replace, remove}) {
    map_.Edit(batch);
    ExpectSame(**map_.stored->Load(), *map_.snapshot);
  }
  ExpectReopensTheSame();
}

TEST_P(ContentContract, IdsOfRemovedObjectsStayTaken) {
  map_.Edit({{CreateLayer{SemanticSpec("s")}, PutObject{"s", UnitSquare("chair"), ""},
              PutObject{"s", UnitSquare("table"), ""}}});
  map_.Edit({{DeleteObject{"s", 2}}});
  map_.Edit({{DeleteLayer{"s"}}});
  Reopen();
  EXPECT_EQ((*map_.stored->Load())->next_object_id, 3);
  ExpectReopensTheSame();
}

TEST_P(ContentContract, FramesMoveToOtherParents) {
  map_.Edit({{SetTransform{{"map", "odom", {1, 2, 0.5}}},
              SetTransform{{"odom", "robot-1/base.link", {0.1, 0, 0}}},
              SetTransform{{"raft", "adrift", {9, 9, 0}}}}});
  map_.Edit({{SetTransform{{"map", "robot-1/base.link", {7, 8, -3}}},
              SetTransform{{"robot-1/base.link", "odom", {-1, 0, 0}}},
              SetTransform{{"map", "raft", {0, 0, 1e-9}}}}});
  ExpectReopensTheSame();
}

}  // namespace
}  // namespace hypermap::storage
