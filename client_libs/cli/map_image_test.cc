#include "client_libs/cli/map_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "client_libs/cli/canvas.h"
#include "client_libs/cli/map_style.h"
#include "client_libs/cli/testing/image.h"

namespace hypermap::cli {
namespace {

// Pixels per metre. A cell is one metre wide.
constexpr double kScale = 20.0;

struct Grid {
  GridGeometry geometry{PlanarTransform(0, 0, 0), 1.0};
  std::vector<CellRun> runs;
};

// Draws the box (0, 0) to (4, 4) with the cells of the grids.
Pixels Draw(MapScene scene, const std::map<std::string, Grid>& grids) {
  scene.box = {{0, 0}, {4, 4}};
  scene.pixels_per_m = kScale;
  const auto image = DrawMap(scene, [&grids](const std::string& layer, const DrawRun& draw) {
    const Grid& grid = grids.at(layer);
    for (const CellRun& run : grid.runs) draw(grid.geometry, run);
    return absl::OkStatus();
  });
  EXPECT_TRUE(image.ok()) << image.status();
  Pixels pixels(image->png);
  EXPECT_EQ(std::pair(image->width, image->height), std::pair(pixels.width(), pixels.height()));
  return pixels;
}

const GridScene kFloorScene{"floor", GridStyle::kFloor, 0, 1, "free", "occupied"};
GridScene SeenScene(const std::string& layer) {
  return {layer, GridStyle::kShade, 0, 1, "unexplored", "explored"};
}

// The colour of the pixel at a point of the map.
uint32_t ColourAt(const Pixels& pixels, double x, double y) {
  return pixels.At(static_cast<int>(kMargin + x * kScale),
                   static_cast<int>(kMargin + (4 - y) * kScale));
}

int Brightness(uint32_t colour) {
  return static_cast<int>((colour >> 16) + (colour >> 8 & 0xFF) + (colour & 0xFF)) / 3;
}

const std::vector<CellRun> kFreeOccupiedUnknown{{0, 0, 1, 0.0}, {0, 1, 2, 1.0}, {0, 2, 3, {}}};

TEST(MapImageTest, OccupancyIsGreyAndNorthIsUp) {
  MapScene scene;
  scene.grids = {kFloorScene};
  const Pixels pixels = Draw(scene, {{"floor", {.runs = kFreeOccupiedUnknown}}});
  EXPECT_EQ(ColourAt(pixels, 0.5, 0.5), 0xF8F8F8u);
  EXPECT_EQ(ColourAt(pixels, 1.5, 0.5), 0x141414u);
  EXPECT_EQ(ColourAt(pixels, 2.5, 0.5), 0x999999u);
  EXPECT_EQ(ColourAt(pixels, 3.5, 0.5), 0xFFFFFFu) << "outside of the layer";
  EXPECT_EQ(ColourAt(pixels, 1.5, 3.5), 0xFFFFFFu) << "the row is the lowest";
}

TEST(MapImageTest, UnexploredIsDarkWhicheverLayerIsNamedFirst) {
  MapScene scene;
  scene.grids = {SeenScene("a_seen"), kFloorScene};
  const Pixels pixels = Draw(scene, {{"floor", {.runs = {{0, 0, 3, 0.0}}}},
                                     {"a_seen", {.runs = {{0, 0, 1, 1.0}, {0, 1, 2, 0.0}}}}});
  EXPECT_EQ(ColourAt(pixels, 0.5, 0.5), 0xF8F8F8u) << "explored";
  EXPECT_LT(Brightness(ColourAt(pixels, 1.5, 0.5)), 160) << "unexplored";
  EXPECT_EQ(ColourAt(pixels, 2.5, 0.5), 0xF8F8F8u) << "outside of the layer";
}

TEST(MapImageTest, NumbersAreTintsFromLightToStrong) {
  MapScene scene;
  scene.grids = {{"wifi", GridStyle::kTint, -90, -40, "-90 dBm", "-40 dBm"}};
  const Pixels pixels =
      Draw(scene, {{"wifi", {.runs = {{0, 0, 1, -90.0}, {0, 1, 2, -65.0}, {0, 2, 3, -40.0}}}}});
  EXPECT_GT(Brightness(ColourAt(pixels, 0.5, 0.5)), Brightness(ColourAt(pixels, 1.5, 0.5)) + 20);
  EXPECT_GT(Brightness(ColourAt(pixels, 1.5, 0.5)), Brightness(ColourAt(pixels, 2.5, 0.5)) + 20);
}

TEST(MapImageTest, ValuesAreComparedWithTheRangeOfTheScene) {
  MapScene scene;
  scene.grids = {{"gas", GridStyle::kFloor, 100, 300, "free", "occupied"},
                 {"wet", GridStyle::kShade, 5, 8, "dry", "wet"}};
  const Pixels pixels =
      Draw(scene, {{"gas", {.runs = {{0, 0, 1, 100.0}, {0, 1, 2, 300.0}, {0, 2, 4, 100.0}}}},
                   {"wet", {.runs = {{0, 2, 3, 5.0}, {0, 3, 4, 8.0}}}}});
  EXPECT_EQ(ColourAt(pixels, 0.5, 0.5), 0xF8F8F8u);
  EXPECT_EQ(ColourAt(pixels, 1.5, 0.5), 0x141414u);
  EXPECT_LT(Brightness(ColourAt(pixels, 2.5, 0.5)), 160) << "the low value darkens";
  EXPECT_EQ(ColourAt(pixels, 3.5, 0.5), 0xF8F8F8u) << "the high value does not";
}

TEST(MapImageTest, ATurnedGridIsDrawnTurned) {
  MapScene scene;
  scene.grids = {kFloorScene};
  // The cell is a square that stands on its corner at (2, 1) and reaches up to (2, 1 + sqrt(2)).
  const Grid grid{{PlanarTransform(2, 1, std::acos(-1) / 4), 1.0}, {{0, 0, 1, 1.0}}};
  const Pixels pixels = Draw(scene, {{"floor", grid}});
  EXPECT_EQ(ColourAt(pixels, 2.0, 1.2), 0x141414u);
  EXPECT_EQ(ColourAt(pixels, 2.0, 2.3), 0x141414u);
  EXPECT_EQ(ColourAt(pixels, 1.5, 1.7), 0x141414u);
  EXPECT_EQ(ColourAt(pixels, 1.5, 1.2), 0xFFFFFFu);
  EXPECT_EQ(ColourAt(pixels, 2.5, 2.3), 0xFFFFFFu);
}

TEST(MapImageTest, CellsSmallerThanAPixelSumUpWithoutSeams) {
  MapScene scene;
  scene.grids = {kFloorScene};
  Grid fine{{PlanarTransform(0, 0, 0), 0.03}, {}};
  for (int row = 0; row < 100; ++row) {
    for (int col = 0; col < 100; ++col) fine.runs.push_back({row, col, col + 1, 1.0});
  }
  const Pixels pixels = Draw(scene, {{"floor", fine}});
  for (double x = 0.5; x < 2.5; x += 1 / kScale) {
    ASSERT_LE(Brightness(ColourAt(pixels, x, 1.5)), 0x1C) << x;
  }
}

TEST(MapImageTest, ObjectsHaveTheColourOfTheirClassAndFadeInDoubt) {
  const Polygon left = Polygon::FromBox({{0, 0}, {1.5, 3}});
  const Polygon right = Polygon::FromBox({{2, 0}, {3.5, 3}});
  MapScene scene;
  scene.objects = {{"chair", 1.0, left}, {"Chair", 0.3, right}};
  const Pixels pixels = Draw(scene, {});
  const Colour colour = ColourOfLabel("chair");
  const uint32_t sure = ColourAt(pixels, 0.75, 1.5), doubtful = ColourAt(pixels, 2.75, 1.5);
  EXPECT_NEAR(sure >> 16, 255 * (0.85 * colour.red + 0.15), 1.5);
  EXPECT_NEAR(sure >> 8 & 0xFF, 255 * (0.85 * colour.green + 0.15), 1.5);
  EXPECT_NEAR(sure & 0xFF, 255 * (0.85 * colour.blue + 0.15), 1.5);
  EXPECT_NEAR(doubtful >> 16, 255 * (0.255 * colour.red + 0.745), 1.5);
  EXPECT_EQ(ColourAt(pixels, 1.75, 1.5), 0xFFFFFFu);
  EXPECT_LT(Brightness(ColourAt(pixels, 0.75, 0.01)), Brightness(sure)) << "the outline";
}

TEST(MapImageTest, SmallObjectsLieOnLargeOnes) {
  const Polygon cup = Polygon::FromBox({{1, 1}, {2, 2}});
  const Polygon table = Polygon::FromBox({{0, 0}, {4, 4}});
  MapScene scene;
  scene.objects = {{"cup", 1.0, cup}, {"table", 1.0, table}};
  const Pixels both = Draw(scene, {});
  scene.objects = {{"table", 1.0, table}, {"cup", 1.0, cup}};
  EXPECT_EQ(ColourAt(both, 1.5, 1.5), ColourAt(Draw(scene, {}), 1.5, 1.5));
  EXPECT_NE(ColourAt(both, 1.5, 1.5), ColourAt(both, 3.5, 3.5));
}

TEST(MapImageTest, LinesAreStrokedAndPointsAreDiscsInTheColourOfTheirClass) {
  MapScene scene;
  scene.objects = {{"lane", 1.0, *LineString::Make({{0.5, 0.5}, {3.5, 0.5}, {3.5, 2.5}})},
                   {"dock", 1.0, *Shape::MakePoint({1.5, 2.5})}};
  const Pixels pixels = Draw(scene, {});
  EXPECT_EQ(ColourAt(pixels, 2.0, 0.5), RgbOf(ColourOfLabel("lane")));
  EXPECT_EQ(ColourAt(pixels, 3.5, 1.5), RgbOf(ColourOfLabel("lane")));
  EXPECT_EQ(ColourAt(pixels, 2.0, 1.5), 0xFFFFFFu) << "a line is not filled";
  EXPECT_EQ(ColourAt(pixels, 0.5, 2.5), 0xFFFFFFu);
  EXPECT_EQ(ColourAt(pixels, 1.5, 2.5), RgbOf(ColourOfLabel("dock")));
  EXPECT_EQ(ColourAt(pixels, 1.6, 2.6), RgbOf(ColourOfLabel("dock"))) << "some pixels wide";
  EXPECT_EQ(ColourAt(pixels, 2.0, 2.5), 0xFFFFFFu);
}

TEST(MapImageTest, LinesAndPointsArePaleInDoubt) {
  MapScene scene;
  scene.objects = {{"lane", 0.2, *LineString::Make({{0, 1}, {4, 1}})},
                   {"lane", 0.2, *Shape::MakePoint({2, 3})}};
  const Pixels pixels = Draw(scene, {});
  const uint32_t pale = RgbOf(Mix(ColourOfLabel("lane"), Grey(1.0), 0.2));
  EXPECT_EQ(ColourAt(pixels, 2, 1), pale);
  EXPECT_EQ(ColourAt(pixels, 2, 3), pale);
}

TEST(MapImageTest, PointsLieOnLinesAndLinesOnPolygons) {
  MapScene scene;
  scene.objects = {{"dock", 1.0, *Shape::MakePoint({2, 2})},
                   {"lane", 1.0, *LineString::Make({{1, 2}, {3, 2}})},
                   {"pad", 1.0, Polygon::FromBox({{0, 0}, {4, 4}})}};
  const Pixels pixels = Draw(scene, {});
  EXPECT_EQ(ColourAt(pixels, 2, 2), RgbOf(ColourOfLabel("dock")));
  EXPECT_EQ(ColourAt(pixels, 1.3, 2), RgbOf(ColourOfLabel("lane")));
}

// Counts the pixels of a colour right of the plan, where the legend is.
int PixelsOfTheLegend(const Pixels& pixels, const Colour& c) {
  int count = 0;
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = static_cast<int>(2 * kMargin + 4 * kScale); x < pixels.width(); ++x) {
      count += pixels.At(x, y) == RgbOf(c);
    }
  }
  return count;
}

TEST(MapImageTest, TheLegendShowsTheShapesOfAClass) {
  const Colour colour = ColourOfLabel("gate");
  const auto shown = [&colour](std::vector<Shape> shapes) {
    MapScene scene;
    for (Shape& shape : shapes) scene.objects.push_back({"gate", 1.0, std::move(shape)});
    return PixelsOfTheLegend(Draw(scene, {}), colour);
  };
  const Shape polygon = Polygon::FromBox({{1, 1}, {2, 2}});
  const Shape line = *LineString::Make({{1, 1}, {2, 2}});
  const Shape point = *Shape::MakePoint({1, 1});
  const int square = shown({polygon}), stroke = shown({line}), disc = shown({point});
  EXPECT_EQ(square, 14 * 14);
  EXPECT_GE(stroke, 14 * 2);
  EXPECT_LT(stroke, 14 * 4);
  EXPECT_GT(disc, 50);
  EXPECT_LT(disc, 100);
  EXPECT_EQ(shown({line, line, point}), stroke + disc) << "a row for each kind of shape";
}

TEST(MapImageTest, TheBorderOfTheAreaIsDrawnAndNothingBeyondThePlan) {
  MapScene scene;
  scene.objects = {{"table", 1.0, Polygon::FromBox({{-3, 1}, {2, 2}})}};
  const Pixels plain = Draw(scene, {});
  EXPECT_EQ(ColourAt(plain, -0.5, 1.5), 0xFFFFFFu) << "beyond the plan";
  EXPECT_NE(ColourAt(plain, 0.5, 1.5), 0xFFFFFFu);
  EXPECT_EQ(ColourAt(plain, 3.0, 3.5), 0xFFFFFFu);
  scene.area = Polygon::FromBox({{1, 0}, {3, 4}});
  EXPECT_EQ(ColourAt(Draw(scene, {}), 3.0, 3.5), 0x0040E6u);
}

// The lower half is floor, of which (0, 0) to (1, 1) is explored. The area to explore is the left
// three quarters.
MapScene ExplorationScenes() {
  MapScene scene;
  scene.grids = {kFloorScene, SeenScene("seen")};
  scene.explorations = {{Polygon::FromBox({{0, 0}, {3, 4}}), "seen"}};
  return scene;
}

const std::map<std::string, Grid> kHalfSeen{
    {"floor", {.runs = {{0, 0, 4, 0.0}, {1, 0, 1, 0.0}, {1, 1, 2, 1.0}, {1, 2, 3, {}}}}},
    {"seen", {.runs = {{0, 0, 1, 1.0}}}}};

TEST(MapImageTest, FloorThatIsExploredIsDarkUntilItHasBeenSeen) {
  const Pixels pixels = Draw(ExplorationScenes(), kHalfSeen);
  EXPECT_EQ(ColourAt(pixels, 0.5, 0.5), 0xF8F8F8u) << "seen";
  const uint32_t unseen = ColourAt(pixels, 1.5, 0.5), beyond = ColourAt(pixels, 3.5, 0.5);
  EXPECT_LT(Brightness(unseen), 140);
  EXPECT_EQ(ColourAt(pixels, 0.5, 1.5), unseen) << "the seen cells do not reach there";
  EXPECT_EQ(ColourAt(pixels, 1.5, 1.5), 0x141414u) << "a wall";
  EXPECT_EQ(ColourAt(pixels, 2.5, 1.5), 0x999999u) << "unknown";
  EXPECT_EQ(ColourAt(pixels, 1.5, 3.5), 0xFFFFFFu) << "no floor";
  EXPECT_GT(Brightness(beyond), Brightness(unseen) + 50);
  EXPECT_LT(Brightness(beyond), 0xF0);
}

TEST(MapImageTest, UnexploredCellsAreNotDarkenedTwice) {
  MapScene scene = ExplorationScenes();
  std::map<std::string, Grid> grids = kHalfSeen;
  const uint32_t unseen = ColourAt(Draw(scene, grids), 1.5, 0.5);
  grids["seen"].runs.push_back({0, 1, 2, 0.0});
  EXPECT_EQ(ColourAt(Draw(scene, grids), 1.5, 0.5), unseen);
}

TEST(MapImageTest, AnExplorationOfAnotherLayerDarkensNothing) {
  MapScene scene = ExplorationScenes();
  scene.explorations[0].layer = "";
  EXPECT_EQ(ColourAt(Draw(scene, kHalfSeen), 1.5, 0.5), 0xF8F8F8u);
}

// Returns whether a pixel on the line between two points of the map has this colour.
bool HasColour(const Pixels& pixels, const Colour& c, const Point& from, const Point& to) {
  const uint32_t wanted = RgbOf(c);
  constexpr int kSteps = 200;
  for (int i = 0; i <= kSteps; ++i) {
    const double share = static_cast<double>(i) / kSteps;
    const Point at{from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)};
    if (ColourAt(pixels, at.x, at.y) == wanted) return true;
  }
  return false;
}

TEST(MapImageTest, TheBorderOfAnExplorationIsABrokenLine) {
  const Pixels pixels = Draw(ExplorationScenes(), kHalfSeen);
  EXPECT_TRUE(HasColour(pixels, kExplorationBorder, {3, 1}, {3, 3}));
  EXPECT_TRUE(HasColour(pixels, Grey(1.0), {3, 0.1}, {3, 0.9})) << "between the dashes";
  EXPECT_FALSE(HasColour(pixels, kExplorationBorder, {0.5, 2}, {2.5, 2})) << "not filled";
}

TEST(MapImageTest, PathsAndGoalsHaveTheColourOfTheirRobot) {
  MapScene scene;
  scene.paths = {{"r1", {{0.5, 0.5}, {0.5, 2}, {2, 2}}}, {"r2", {{3.5, 0.5}, {3.5, 2}}}};
  scene.goals = {{"r2", {3, 3}}};
  const RobotColours robots(scene);
  const Pixels pixels = Draw(scene, {});
  EXPECT_TRUE(HasColour(pixels, robots.Of("r1"), {0, 1}, {1, 1}));
  EXPECT_TRUE(HasColour(pixels, robots.Of("r1"), {1, 1.5}, {1, 2.5}));
  EXPECT_TRUE(HasColour(pixels, robots.Of("r1"), {2.2, 1.8}, {2.2, 2.2})) << "the mark at the end";
  EXPECT_TRUE(HasColour(pixels, robots.Of("r2"), {3, 1}, {4, 1}));
  EXPECT_TRUE(HasColour(pixels, robots.Of("r2"), {2.9, 3}, {3.1, 3}));
  EXPECT_FALSE(HasColour(pixels, robots.Of("r1"), {2.5, 1}, {4, 1}));
}

TEST(MapImageTest, APathOfOnePointIsItsEnd) {
  MapScene scene;
  scene.paths = {{"r1", {{2, 2}}}};
  EXPECT_TRUE(HasColour(Draw(scene, {}), RobotColours(scene).Of("r1"), {1.9, 2}, {2.1, 2}));
}

TEST(MapImageTest, PlacesThatCannotBeReachedAreCrosses) {
  MapScene scene;
  scene.unreachable_places = {{2, 2}};
  const Pixels pixels = Draw(scene, {});
  EXPECT_TRUE(HasColour(pixels, kUnreachable, {1.9, 2.1}, {2.1, 1.9}));
  EXPECT_TRUE(HasColour(pixels, kUnreachable, {2.2, 2}, {2.2, 2.4}));
  EXPECT_FALSE(HasColour(pixels, kUnreachable, {2, 2.2}, {2, 2.6})) << "between its arms";
}

TEST(MapImageTest, ALongLegendIsCutShort) {
  MapScene scene;
  scene.objects = {{"table", 1.0, Polygon::FromBox({{1, 1}, {2, 2}})}};
  const int usual = Draw(scene, {}).height();
  for (int i = 0; i < 500; ++i) scene.objects.push_back({std::to_string(i), 1.0, {}});
  const Pixels pixels = Draw(scene, {});
  EXPECT_LT(pixels.height(), 800);
  EXPECT_GE(pixels.height(), usual);
  EXPECT_LT(pixels.width(), 1200);
}

TEST(MapImageTest, ErrorsOfTheCellsAreAnswered) {
  MapScene scene;
  scene.box = {{0, 0}, {4, 4}};
  scene.grids = {kFloorScene};
  const auto image = DrawMap(
      scene, [](const std::string&, const DrawRun&) { return absl::UnavailableError("gone"); });
  EXPECT_EQ(image.status(), absl::UnavailableError("gone"));
}

// "#rrggbb".
std::string HexOf(const Colour& c) {
  return absl::StrFormat("#%02x%02x%02x", std::lround(255 * c.red), std::lround(255 * c.green),
                         std::lround(255 * c.blue));
}

// Golden values, because people compare new pictures with old ones.
TEST(ColourOfLabelTest, IsThatOfTheLabelHoweverSpelt) {
  EXPECT_EQ(HexOf(ColourOfLabel("chair")), "#264ca6");
  EXPECT_EQ(HexOf(ColourOfLabel("couch")), "#99f2dd");
  EXPECT_EQ(HexOf(ColourOfLabel("diningtable")), "#f29c99");
  EXPECT_EQ(HexOf(ColourOfLabel(" Dining  TABLE ")), HexOf(ColourOfLabel("dining table")));
}

}  // namespace
}  // namespace hypermap::cli
