#include "simulation/worlds/world_from_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/exploration/testing/drawn_floor.h"
#include "simulation/worlds/class_heights.h"

namespace hypermap::simulation {
namespace {

using ::hypermap::testing::DrawnFloor;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::IsEmpty;
using ::testing::SizeIs;

const GridGeometry kMetres{{}, 1.0};

SemanticObject Thing(const std::string& label, const Box& box) {
  SemanticObject object;
  object.label = label;
  object.shape = Polygon::FromBox(box);
  return object;
}

HeightRange HeightIn(const Scene& scene, size_t body) { return HeightOf(scene.bodies[body]); }

TEST(ClassHeightTest, NamesAreTakenAsPeopleWriteThem) {
  EXPECT_EQ(HeightOfClass("Dining Table").height_m, 0.74);
  EXPECT_EQ(HeightOfClass("dining_table").height_m, 0.74);
  EXPECT_EQ(HeightOfClass("chair\r").height_m, 0.9);
  EXPECT_EQ(HeightOfClass("flux capacitor").height_m, 1.0);
}

TEST(WorldFromMapTest, CellsThatAreNotFreeAreWalls) {
  const Scene scene = WorldFromMap(DrawnFloor({"..#", "..?"}), kMetres, {});
  ASSERT_TRUE(scene.walls.has_value());
  EXPECT_EQ(scene.walls->Hit({0.5, 0.5, 1}, {1, 0, 0}, 9), 1.5);
  EXPECT_EQ(scene.walls->Hit({0.5, 1.5, 1}, {1, 0, 0}, 9), 1.5);
  EXPECT_EQ(scene.walls->Hit({0.5, 1.5, 1}, {-1, 0, 0}, 9), std::nullopt);
  EXPECT_EQ(scene.bounds, (Box{{0, 0}, {3, 2}}));
  EXPECT_THAT(scene.bodies, IsEmpty());
}

TEST(WorldFromMapTest, ObjectsStandWhereTheirWallsWere) {
  const Scene scene = WorldFromMap(DrawnFloor({"...#?", "...#."}), kMetres,
                                   {Thing("chair", {{3.1, 0.1}, {4, 1.9}})});
  ASSERT_THAT(scene.bodies, SizeIs(1));
  EXPECT_EQ(scene.bodies[0].label, "chair");
  ASSERT_THAT(scene.bodies[0].parts, SizeIs(1));
  EXPECT_EQ(scene.bodies[0].parts[0].footprint, Polygon::FromBox({{3.1, 0.1}, {4, 1.9}}).outer());
  EXPECT_EQ(HeightIn(scene, 0), (HeightRange{0, 0.9}));
  EXPECT_EQ(scene.walls->plan().at({0, 3}), Floor::kFree);
  EXPECT_EQ(scene.walls->plan().at({1, 3}), Floor::kFree);
  EXPECT_EQ(scene.walls->plan().at({1, 4}), Floor::kUnknown) << "unknown is no furniture";
}

TEST(WorldFromMapTest, ObjectsStandWhereNobodyKnewOfFloor) {
  const Scene scene =
      WorldFromMap(DrawnFloor({"..??", "..??"}), kMetres, {Thing("couch", {{2, 0}, {3.2, 1}})});
  EXPECT_EQ(scene.walls->plan().at({0, 2}), Floor::kFree);
  EXPECT_EQ(scene.walls->plan().at({0, 3}), Floor::kUnknown) << "it ends before the cell's centre";
  EXPECT_EQ(scene.walls->plan().at({1, 2}), Floor::kUnknown);
}

TEST(WorldFromMapTest, HeightsOfTheThingGoBeforeThoseOfItsClass) {
  SemanticObject low = Thing("chair", {{0, 0}, {1, 1}});
  low.height = HeightRange{0.1, 0.3};
  const Scene scene = WorldFromMap(DrawnFloor({".."}), kMetres, {low});
  EXPECT_EQ(HeightIn(scene, 0), (HeightRange{0.1, 0.3}));
}

TEST(WorldFromMapTest, SmallThingsStandOnTables) {
  SemanticObject table = Thing("table", {{0, 0}, {2, 1}});
  const SemanticObject cup = Thing("cup", {{0.5, 0.5}, {0.6, 0.6}});
  Scene scene = WorldFromMap(DrawnFloor({".."}), kMetres, {cup, table});
  EXPECT_NEAR(HeightIn(scene, 0).low_m, 0.74, 1e-9);
  EXPECT_NEAR(HeightIn(scene, 0).high_m, 0.84, 1e-9);
  EXPECT_EQ(HeightIn(scene, 1), (HeightRange{0, 0.74}));
  table.height = HeightRange{0, 0.5};
  scene = WorldFromMap(DrawnFloor({".."}), kMetres, {cup, table});
  EXPECT_EQ(HeightIn(scene, 0).low_m, 0.5);
  scene = WorldFromMap(DrawnFloor({".."}), kMetres, {cup});
  EXPECT_EQ(HeightIn(scene, 0).low_m, 0.0);
}

TEST(WorldFromMapTest, FootprintsAreMadeConvexAndThoseWithoutAreaLeftOut) {
  SemanticObject corner = Thing("couch", {{0, 0}, {1, 1}});
  corner.shape = *Polygon::Make({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}});
  SemanticObject nowhere = Thing("chair", {{0, 0}, {1, 1}});
  nowhere.shape = Polygon();
  const Scene scene = WorldFromMap(DrawnFloor({"..", ".."}), kMetres, {nowhere, corner});
  EXPECT_THAT(scene.bodies, ElementsAre(Field(&Body::label, "couch")));
  EXPECT_THAT(scene.bodies[0].parts[0].footprint, SizeIs(5));
}

TEST(WorldFromMapTest, LinesAndPointsAreNoObstaclesAndCarryNothing) {
  SemanticObject lane = Thing("lane", {{0, 0}, {1, 1}});
  lane.shape = *LineString::Make({{0, 0.5}, {3, 0.5}});
  // Tables carry things, but these are a point and a line at the middle of the cup.
  SemanticObject table = Thing("table", {{0, 0}, {1, 1}});
  table.shape = *Shape::MakePoint({0.5, 0.5});
  SemanticObject sill = Thing("table", {{0, 0}, {1, 1}});
  sill.shape = *LineString::Make({{0.5, 0}, {0.5, 1}});
  const SemanticObject cup = Thing("cup", {{0.4, 0.4}, {0.6, 0.6}});
  const Scene scene = WorldFromMap(DrawnFloor({"..#"}), kMetres, {lane, table, sill, cup});
  EXPECT_THAT(scene.bodies, ElementsAre(Field(&Body::label, "cup")));
  EXPECT_EQ(HeightIn(scene, 0).low_m, 0.0) << "it stands on the floor";
  EXPECT_EQ(scene.walls->plan().at({0, 2}), Floor::kOccupied) << "the lane opens no wall";
}

}  // namespace
}  // namespace hypermap::simulation
