#include "ingest/perception/footprint.h"

#include <limits>

#include "gtest/gtest.h"
#include "ingest/perception/testing/box_scene.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "map/geometry/predicates.h"

namespace hypermap::ingest {
namespace {

using testing::BoxScene;
using testing::LookFrom;
using testing::Photograph;
using testing::PixelsOf;
using testing::Shot;
using testing::TestCamera;

constexpr int kThing = 0;

// A chest on the floor, and a camera in front of it that looks down on it.
const Box kChest{{1.5, -0.2}, {1.9, 0.2}};
BoxScene Chest() { return {true, {{{1.5, -0.2, 0.0}, {1.9, 0.2, 0.5}}}}; }
Eigen::Isometry3d Before() { return LookFrom({0.2, 0, 1.3}, 0.0, 0.6); }

Polygon Widened(const Box& box, double by) {
  return Polygon::FromBox({{box.min.x - by, box.min.y - by}, {box.max.x + by, box.max.y + by}});
}

std::vector<Point> CentresOf(const CellPatch& cells) {
  std::vector<Point> centres;
  for (const CellSpan& span : cells.spans) {
    for (int32_t col = span.col_begin; col < span.col_end; ++col) {
      centres.push_back(cells.frame_from_cells * Point{(col + 0.5) * cells.resolution_m,
                                                       (span.row + 0.5) * cells.resolution_m});
    }
  }
  return centres;
}

TEST(FootprintTest, HullAndCellsLieOnTheBox) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before());
  const auto footprint = MakeFootprint(shot.Cloud(), PixelsOf(shot.MaskOf(kThing)), {});
  ASSERT_TRUE(footprint);
  for (const Point& p : footprint->hull.outer()) EXPECT_TRUE(Covers(Widened(kChest, 0.01), p));
  EXPECT_GT(Iou(footprint->hull, Polygon::FromBox(kChest)), 0.9);
  EXPECT_TRUE(IsConvex(footprint->hull));
  EXPECT_EQ(footprint->cells.resolution_m, 0.01);
  EXPECT_FALSE(footprint->cells.spans.empty());
  for (const Point& p : CentresOf(footprint->cells)) {
    EXPECT_TRUE(Covers(Widened(kChest, 0.02), p)) << p.x << ", " << p.y;
  }
  EXPECT_GE(footprint->height.low_m, 0.03);
  EXPECT_LT(footprint->height.low_m, 0.08);
  EXPECT_NEAR(footprint->height.high_m, 0.5, 0.01);
  EXPECT_GT(footprint->range_m, 1.5);
  EXPECT_LT(footprint->range_m, 1.9);
}

TEST(FootprintTest, NoiseMovesTheHullByCentimetres) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before(), 31);
  const auto footprint = MakeFootprint(shot.Cloud(), PixelsOf(shot.MaskOf(kThing)), {});
  ASSERT_TRUE(footprint);
  for (const Point& p : footprint->hull.outer()) EXPECT_TRUE(Covers(Widened(kChest, 0.03), p));
  EXPECT_GT(Iou(footprint->hull, Polygon::FromBox(kChest)), 0.85);
}

TEST(FootprintTest, WideThingsHaveCoarseCells) {
  const BoxScene table{true, {{{1.5, -0.6, 0.7}, {2.0, 0.6, 0.75}}}};
  const Shot shot = Photograph(table, TestCamera(160), Before());
  const auto footprint = MakeFootprint(shot.Cloud(), PixelsOf(shot.MaskOf(kThing)), {});
  ASSERT_TRUE(footprint);
  EXPECT_EQ(footprint->cells.resolution_m, 0.025);
}

TEST(FootprintTest, FloorIsNoPartOfIt) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before());
  const OrganisedCloud cloud = shot.Cloud();
  EXPECT_FALSE(MakeFootprint(cloud, PixelsOf(shot.MaskOf(Shot::kFloor)), {}));
  const auto grown = PixelsOf(testing::Grown(shot.MaskOf(kThing), 160, 4));
  const auto footprint = MakeFootprint(cloud, grown, {});
  ASSERT_TRUE(footprint);
  for (const Point& p : footprint->hull.outer()) EXPECT_TRUE(Covers(Widened(kChest, 0.01), p));
}

// The mask also covers a few pixels of a wall 2 m behind the chest.
TEST(FootprintTest, StraysAreNoPartOfIt) {
  BoxScene scene = Chest();
  scene.boxes.push_back({{4.0, -3.0, 0.0}, {4.1, 3.0, 2.5}});
  const Shot shot = Photograph(scene, TestCamera(160), LookFrom({0.2, 0, 1.3}, 0.0, 0.3));
  testing::Mask mask = shot.MaskOf(kThing);
  const testing::Mask wall = shot.MaskOf(1);
  int strays = 0;
  for (size_t i = 0; i < mask.size() && strays < 20; ++i) {
    if (!wall[i]) continue;
    mask[i] = 1;
    ++strays;
  }
  ASSERT_EQ(strays, 20);
  const auto footprint = MakeFootprint(shot.Cloud(), PixelsOf(mask), {});
  ASSERT_TRUE(footprint);
  for (const Point& p : footprint->hull.outer()) EXPECT_TRUE(Covers(Widened(kChest, 0.01), p));
}

TEST(FootprintTest, PointsBeyondTheRangeAreNoPartOfIt) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before());
  const auto pixels = PixelsOf(shot.MaskOf(kThing));
  EXPECT_FALSE(MakeFootprint(shot.Cloud(), pixels, {.max_range_m = 1.0f}));
  const auto near = MakeFootprint(shot.Cloud(), pixels, {.max_range_m = 1.7f});
  const auto all = MakeFootprint(shot.Cloud(), pixels, {});
  ASSERT_TRUE(near);
  ASSERT_TRUE(all);
  EXPECT_LT(near->num_points, all->num_points);
}

TEST(FootprintTest, TooFewPointsGiveNone) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before());
  const OrganisedCloud cloud = shot.Cloud();
  // Nine pixels of the lid are enough, and seven are not.
  const int32_t middle = 50 * 160 + 80;
  std::vector<int32_t> pixels;
  for (int v = -1; v <= 1; ++v) {
    for (int u = -1; u <= 1; ++u) {
      ASSERT_EQ(shot.seen[middle + 160 * v + u], kThing);
      pixels.push_back(middle + 160 * v + u);
    }
  }
  EXPECT_TRUE(MakeFootprint(cloud, pixels, {}));
  pixels.resize(7);
  EXPECT_FALSE(MakeFootprint(cloud, pixels, {}));
  EXPECT_FALSE(MakeFootprint(cloud, {}, {}));
}

// The pixels are one column on the chest's upright front.
TEST(FootprintTest, PointsOnOneLineGiveNone) {
  const Shot shot = Photograph(Chest(), TestCamera(160), LookFrom({0.2, 0, 0.3}, 0.0, 0.0));
  std::vector<int32_t> column;
  for (int v = 0; v < 120; ++v) {
    if (shot.seen[v * 160 + 80] == kThing) column.push_back(v * 160 + 80);
  }
  ASSERT_GT(column.size(), 20u);
  EXPECT_FALSE(MakeFootprint(shot.Cloud(), column, {}));
}

TEST(FootprintTest, IsAsExactFarFromTheOrigin) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before(), 32);
  const auto pixels = PixelsOf(shot.MaskOf(kThing));
  Eigen::Isometry3d far_pose = shot.pose;
  far_pose.translation() += Eigen::Vector3d(1e5, -1e5, 0.0);
  const auto here = MakeFootprint(shot.Cloud(), pixels, {});
  const auto there = MakeFootprint(shot.CloudAt(far_pose), pixels, {});
  ASSERT_TRUE(here);
  ASSERT_TRUE(there);
  EXPECT_EQ(there->cells.spans, here->cells.spans);
  EXPECT_EQ(there->num_points, here->num_points);
  EXPECT_EQ(there->height, here->height);
  EXPECT_EQ(there->range_m, here->range_m);
  const PlanarTransform back(-1e5, 1e5, 0.0);
  EXPECT_NEAR((back * there->hull).bounds().min.x, here->hull.bounds().min.x, 1e-9);
  EXPECT_NEAR((back * there->hull).bounds().max.y, here->hull.bounds().max.y, 1e-9);
  EXPECT_NEAR(Area(there->hull), Area(here->hull), 1e-9);
}

TEST(FootprintTest, PointsThatAreNotFiniteAreNoPartOfIt) {
  const Shot shot = Photograph(Chest(), TestCamera(160), Before());
  const std::vector<int32_t> pixels = PixelsOf(shot.MaskOf(kThing));
  for (const float number :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(), std::numeric_limits<float>::max()}) {
    OrganisedCloud cloud = shot.Cloud();
    for (size_t i = 0; i < pixels.size(); i += 3) cloud.camera[pixels[i]].x() = number;
    const auto footprint = MakeFootprint(cloud, pixels, {});
    ASSERT_TRUE(footprint) << number;
    for (const Point& p : footprint->hull.outer()) {
      EXPECT_TRUE(Covers(Widened(kChest, 0.01), p)) << number;
    }
    for (const int32_t pixel : pixels) cloud.camera[pixel].y() = number;
    EXPECT_FALSE(MakeFootprint(cloud, pixels, {})) << number;
  }
}

}  // namespace
}  // namespace hypermap::ingest
