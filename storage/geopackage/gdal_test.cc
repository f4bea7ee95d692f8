// GDAL as an outside judge of our files, also while they are open for writing.
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/grid_layer.h"
#include "map/layers/semantic_layer.h"
#include "nlohmann/json.hpp"
#include "storage/conformance/testing/edited_map.h"
#include "storage/geopackage/testing/map.h"
#include "tests/support/random_map.h"

namespace hypermap::storage {
namespace {

using ::hypermap::testing::RandomSite;
using ::hypermap::testing::Rng;
using ::hypermap::testing::TestSeed;
using ::testing::HasSubstr;
using ::testing::Not;

struct Output {
  int exit_code = -1;
  std::string text;  // also of stderr
};

Output RunCommand(const std::string& command) {
  Output output;
  FILE* pipe = popen(absl::StrCat("(", command, ") 2>&1").c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 4096> buffer;
  while (const size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) {
    output.text.append(buffer.data(), n);
  }
  output.exit_code = pclose(pipe);
  return output;
}

class GdalTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Output found = RunCommand(
        "/usr/bin/python3 -c 'import osgeo_utils.samples.validate_gpkg'"
        " && gdalinfo --version && ogrinfo --version && gdallocationinfo --version");
    if (found.exit_code != 0) GTEST_SKIP() << "needs gdal-bin and python3-gdal";
    store_ = OpenStore(folder_.path());
  }

  // The validator's extra checks go beyond the standard; warnings are errors.
  void ExpectValid(const std::string& name) {
    const Output output =
        RunCommand(absl::StrCat("/usr/bin/python3 -m osgeo_utils.samples.validate_gpkg -k --extra "
                                "--warning-as-error ",
                                folder_ / name, ".gpkg"));
    EXPECT_EQ(output.exit_code, 0) << output.text;
    EXPECT_THAT(output.text, Not(HasSubstr("Req"))) << output.text;
  }

  nlohmann::json GdalInfo(const std::string& dataset) {
    const Output output = RunCommand(absl::StrCat("gdalinfo -json ", dataset, " 2>/dev/null"));
    EXPECT_EQ(output.exit_code, 0) << output.text;
    return nlohmann::json::parse(output.text, nullptr, /*allow_exceptions=*/false);
  }

  std::string PathOf(const std::string& name) { return folder_ / name + ".gpkg"; }

  testing::TemporaryFolder folder_;
  std::unique_ptr<MapStore> store_;
};

TEST_F(GdalTest, RandomSitesAreValidOpenAndClosed) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  EditedMap map = CreateMap(*store_, "site");
  ExpectValid("site");
  map.Edit(RandomSite(rng, 30));
  ExpectValid("site");
  map.Edit({{DeleteLayer{"wifi"}, DeleteLayer{"dock.objects"}, DeleteObject{"semantic", 2}}});
  ExpectValid("site");
  map.stored.reset();
  ExpectValid("site");
}

TEST_F(GdalTest, EmptyLayersOfEveryKindAreValid) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(
      {{CreateLayer{SemanticSpec("s")}, CreateLayer{GridSpec("o", LayerKind::kOccupancy, {}, 0.05)},
        CreateLayer{GridSpec("e", LayerKind::kExploration, {}, 0.05)},
        CreateLayer{GridSpec("select", LayerKind::kScalar, {}, 0.05)}}});
  ExpectValid("site");
  const Output output = RunCommand("ogrinfo -ro -al " + PathOf("site"));
  EXPECT_THAT(output.text, HasSubstr("Layer name: s"));
  EXPECT_THAT(output.text, Not(HasSubstr("Warning")));
}

// Layers for every kind of shape and for one kind each, with an object of each kind that they take.
EditBatch ShapesOfEveryKind() {
  SemanticObject room{.label = "room"};
  room.shape = *Polygon::Make({{0, 0}, {4, 0}, {4, 3}});
  SemanticObject lane{.label = "lane"};
  lane.shape = *LineString::Make({{0, 1}, {8, 1}, {8, -2.5}});
  SemanticObject dock{.label = "dock"};
  dock.shape = *Shape::MakePoint({2.5, 1});
  EditBatch batch;
  const auto add = [&](const std::string& name, const ShapeKinds& kinds,
                       const std::vector<SemanticObject>& objects) {
    LayerSpec spec = SemanticSpec(name);
    spec.shape_kinds = kinds;
    batch.edits.push_back(CreateLayer{spec});
    for (const SemanticObject& object : objects) {
      batch.edits.push_back(PutObject{name, object, ""});
    }
  };
  add("things", ShapeKinds(), {room, lane, dock});
  add("rooms", {ShapeKind::kPolygon}, {room});
  add("lanes", {ShapeKind::kLineString}, {lane});
  add("docks", {ShapeKind::kPoint}, {dock});
  return batch;
}

TEST_F(GdalTest, OgrListsEveryKindOfShape) {
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(ShapesOfEveryKind());
  ExpectValid("site");
  const struct {
    const char* layer;
    std::vector<const char*> texts;
  } cases[] = {
      {"things",
       {"Geometry: Unknown (any)", "Feature Count: 3",
        "Extent: (0.000000, -2.500000) - (8.000000, 3.000000)", "POLYGON ((0 0,4 0,4 3,0 0))",
        "LINESTRING (0 1,8 1,8.0 -2.5)", "POINT (2.5 1.0)"}},
      {"rooms", {"Geometry: Polygon", "Feature Count: 1", "POLYGON ((0 0,4 0,4 3,0 0))"}},
      {"lanes", {"Geometry: Line String", "Feature Count: 1", "LINESTRING (0 1,8 1,8.0 -2.5)"}},
      {"docks",
       {"Geometry: Point", "Extent: (2.500000, 1.000000) - (2.500000, 1.000000)",
        "POINT (2.5 1.0)"}}};
  for (const auto& c : cases) {
    const Output output =
        RunCommand(absl::StrCat("ogrinfo -ro -al ", PathOf("site"), " ", c.layer));
    EXPECT_EQ(output.exit_code, 0);
    for (const char* text : c.texts) EXPECT_THAT(output.text, HasSubstr(text)) << c.layer;
    EXPECT_THAT(output.text, Not(HasSubstr("Warning"))) << c.layer;
  }
  // The index finds them by place.
  const Output found =
      RunCommand(absl::StrCat("ogrinfo -ro -al -spat 2 0.5 3 1.5 ", PathOf("site"), " docks"));
  EXPECT_THAT(found.text, HasSubstr("Feature Count: 1"));
}

TEST_F(GdalTest, MapsOfOlderSchemasAreValidAndTakeEveryKindOfShape) {
  for (const char* version : {"1", "2", "3"}) {
    SCOPED_TRACE(version);
    const std::string name = absl::StrCat("old", version);
    const absl::Status made =
        Connect(PathOf(name))
            ->Execute(ReadFile(absl::StrCat(GEOPACKAGE_TESTDATA, "/map_v", version, ".sql")));
    ASSERT_TRUE(made.ok()) << made;
    auto map = store_->Open(name);
    ASSERT_TRUE(map.ok()) << map.status();
    ExpectValid(name);
    EditBatch batch = ShapesOfEveryKind();
    for (Edit& edit : batch.edits) {
      if (auto* put = std::get_if<PutObject>(&edit)) put->layer = "objects";
    }
    std::erase_if(batch.edits,
                  [](const Edit& edit) { return !std::holds_alternative<PutObject>(edit); });
    const Commit commit = MakeCommit(**(*map)->Load(), batch);
    ASSERT_TRUE((*map)->Write({commit}).ok());
    ExpectValid(name);
    const Output output = RunCommand(absl::StrCat("ogrinfo -ro -al ", PathOf(name), " objects"));
    for (const char* text : {"Geometry: Unknown (any)", "POLYGON ((0 0,4 0,4 3,0 0))",
                             "LINESTRING (0 1,8 1,8.0 -2.5)", "POINT (2.5 1.0)"}) {
      EXPECT_THAT(output.text, HasSubstr(text));
    }
    EXPECT_THAT(output.text, Not(HasSubstr("Warning")));
  }
}

TEST_F(GdalTest, OgrListsTheObjectsAndWarnsOfNothing) {
  SemanticObject chair;
  chair.label = "Küchenstuhl";
  chair.shape = *Polygon::Make({{0, 0}, {4, 0}, {4, 4}, {0, 4}}, {{{1, 1}, {1, 2}, {2, 2}}});
  chair.existence = 0.5;
  chair.classes = {{"chair", 0.75}};
  chair.tags = {"furniture"};
  chair.attributes = {{"movable", true}};
  chair.height = HeightRange{0, 1.25};
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{CreateLayer{SemanticSpec("semantic")}, PutObject{"semantic", chair, ""}}});
  const Output output = RunCommand("ogrinfo -ro -al " + PathOf("site"));
  EXPECT_EQ(output.exit_code, 0);
  for (const char* text :
       {"Layer name: semantic", "Geometry: Unknown (any)", "Feature Count: 1",
        "Extent: (0.000000, 0.000000) - (4.000000, 4.000000)", "OGRFeature(semantic):1",
        "label (String) = Küchenstuhl", "existence (Real) = 0.5",
        "classes (String) = {\"chair\":0.75}", "tags (String) = [\"furniture\"]",
        "attributes (String) = {\"movable\":true}", "height_min (Real) = 0",
        "height_max (Real) = 1.25", "POLYGON ((0 0,4 0,4 4,0 4,0 0),(1 1,1 2,2 2,1 1))"}) {
    EXPECT_THAT(output.text, HasSubstr(text));
  }
  EXPECT_THAT(output.text, Not(HasSubstr("Warning")));
  // Only what people look at.
  EXPECT_THAT(output.text, Not(HasSubstr("hypermap_receipts")));
}

TEST_F(GdalTest, SpatialFilterUsesTheIndex) {
  Rng rng(TestSeed());
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 60));
  const auto& layer = dynamic_cast<const SemanticLayer&>(*map.snapshot->FindLayer("semantic"));
  const Box box{{-5, -5}, {6, 7}};
  int expected = 0;
  for (const ObjectPtr& object : layer.Objects()) {
    if (object->shape.bounds().Intersects(box)) ++expected;
  }
  const Output output = RunCommand(absl::StrCat(
      "ogrinfo -ro -q -sql \"SELECT count(*) AS n FROM semantic JOIN rtree_semantic_geom r ON "
      "semantic.id = r.id WHERE minx <= 6 AND maxx >= -5 AND miny <= 7 AND maxy >= -5\" ",
      PathOf("site")));
  EXPECT_THAT(output.text, HasSubstr(absl::StrCat("n (Integer) = ", expected)));
}

TEST_F(GdalTest, GridHasTheExtentInUseAndItsResolution) {
  // The numbers of a real office: 608 x 480 cells of 5 cm.
  EditedMap map = CreateMap(*store_, "office");
  map.Edit(
      {{CreateLayer{GridSpec("occupancy", LayerKind::kOccupancy, {-15.4, -12.2, 0}, 0.05)},
        WriteCells{
            "occupancy", {0, 480, 0, 608}, std::vector<std::optional<double>>(480 * 608, 0.25)}}});
  const nlohmann::json info = GdalInfo(PathOf("office"));
  EXPECT_EQ(info["size"], nlohmann::json({608, 480}));
  const auto transform = info["geoTransform"];
  EXPECT_NEAR(transform[0].get<double>(), -15.4, 1e-9);
  EXPECT_NEAR(transform[1].get<double>(), 0.05, 1e-12);
  EXPECT_NEAR(transform[3].get<double>(), 11.8, 1e-9);
  EXPECT_NEAR(transform[5].get<double>(), -0.05, 1e-12);
  const auto corners = info["cornerCoordinates"];
  EXPECT_NEAR(corners["lowerRight"][0].get<double>(), 15.0, 1e-9);
  EXPECT_NEAR(corners["lowerRight"][1].get<double>(), -12.2, 1e-9);
}

TEST_F(GdalTest, EveryGridIsASubdatasetWithOurValues) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(::testing::Message() << "HYPERMAP_TEST_SEED=" << seed);
  Rng rng(seed);
  EditedMap map = CreateMap(*store_, "site");
  map.Edit(RandomSite(rng, 0));
  EXPECT_THAT(GdalInfo(PathOf("site")).dump(), HasSubstr(":adrift_grid"));
  for (const auto& [layer, table] : {std::pair{"occupancy", "occupancy"},
                                     {"wifi", "wifi"},
                                     {"exploration", "exploration"},
                                     {"adrift-grid", "adrift_grid"}}) {
    const auto& grid = dynamic_cast<const GridLayer&>(*map.snapshot->FindLayer(layer));
    const std::string dataset = absl::StrCat("GPKG:", PathOf("site"), ":", table);
    const CellBox& extent = grid.extent();
    const nlohmann::json info = GdalInfo(dataset);
    EXPECT_EQ(info["size"], nlohmann::json({extent.cols(), extent.rows()}));
    const double no_data = info["bands"][0]["noDataValue"].get<double>();
    // Pixels counted from the upper left corner.
    std::string asked;
    std::vector<CellIndex> cells;
    for (int i = 0; i < 400; ++i) {
      const CellIndex cell{testing::UniformInt(rng, extent.row_begin, extent.row_end - 1),
                           testing::UniformInt(rng, extent.col_begin, extent.col_end - 1)};
      cells.push_back(cell);
      absl::StrAppend(&asked, cell.col - extent.col_begin, " ", extent.row_end - 1 - cell.row,
                      "\n");
    }
    WriteFile(folder_ / "pixels", asked);
    const Output output =
        RunCommand(absl::StrCat("gdallocationinfo -valonly ", dataset, " < ", folder_ / "pixels"));
    const std::vector<std::string> lines = absl::StrSplit(output.text, '\n', absl::SkipEmpty());
    ASSERT_EQ(lines.size(), cells.size()) << output.text;
    for (size_t i = 0; i < cells.size(); ++i) {
      double value = 0;
      ASSERT_TRUE(absl::SimpleAtod(lines[i], &value)) << lines[i];
      const std::optional<double> expected = grid.ValueAt(cells[i]);
      EXPECT_NEAR(value, expected.value_or(no_data), std::abs(value) * 1e-7);
    }
  }
}

TEST_F(GdalTest, ObjectsThatOgrAddsAreRead) {
  SemanticObject chair;
  chair.label = "chair";
  chair.shape = Polygon::FromBox({{0, 0}, {1, 1}});
  EditedMap map = CreateMap(*store_, "site");
  map.Edit({{CreateLayer{SemanticSpec("semantic")}, PutObject{"semantic", chair, ""}}});
  map.stored.reset();
  const Output output = RunCommand(
      absl::StrCat("/usr/bin/python3 -c \"from osgeo import ogr; d = ogr.Open('", PathOf("site"),
                   "', 1); l = d.GetLayerByName('semantic'); f = ogr.Feature(l.GetLayerDefn()); "
                   "f.SetField('label', 'lamp'); "
                   "f.SetGeometry(ogr.CreateGeometryFromWkt('POLYGON((5 5,5 6,6 6,5 5))')); "
                   "l.CreateFeature(f); f.SetFID(-1); "
                   "f.SetGeometry(ogr.CreateGeometryFromWkt('LINESTRING(7 5,7 6,9 9)')); "
                   "l.CreateFeature(f); f.SetFID(-1); "
                   "f.SetGeometry(ogr.CreateGeometryFromWkt('POINT(8.5 9)')); "
                   "l.CreateFeature(f); d = None\""));
  ASSERT_EQ(output.exit_code, 0) << output.text;
  auto opened = store_->Open("site");
  ASSERT_TRUE(opened.ok()) << opened.status();
  auto snapshot = (*opened)->Load();
  ASSERT_TRUE(snapshot.ok()) << snapshot.status();
  const auto& layer = dynamic_cast<const SemanticLayer&>(*(*snapshot)->FindLayer("semantic"));
  ASSERT_NE(layer.Find(2), nullptr);
  EXPECT_EQ(layer.Find(2)->label, "lamp");
  // It was drawn clockwise, and is turned.
  EXPECT_EQ(layer.Find(2)->shape, *Polygon::Make({{5, 5}, {6, 6}, {5, 6}}));
  ASSERT_NE(layer.Find(3), nullptr);
  EXPECT_EQ(layer.Find(3)->shape, *LineString::Make({{7, 5}, {7, 6}, {9, 9}}));
  ASSERT_NE(layer.Find(4), nullptr);
  EXPECT_EQ(layer.Find(4)->shape, *Shape::MakePoint({8.5, 9}));
  EXPECT_EQ((*snapshot)->next_object_id, 5);
  ExpectValid("site");
}

}  // namespace
}  // namespace hypermap::storage
