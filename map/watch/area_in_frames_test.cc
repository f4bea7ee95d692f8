#include "map/watch/area_in_frames.h"

#include <malloc.h>

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using testing::RandomObject;
using testing::RandomPolygon;
using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;

const GridGeometry kGrid{PlanarTransform(), 0.5};

// A star round the origin.
Polygon Star(int vertices) {
  Ring ring;
  for (int i = 0; i < vertices; ++i) {
    const double angle = 2 * M_PI * i / vertices;
    const double radius = i % 2 == 0 ? 10.0 : 9.0;
    ring.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return Polygon::MakeUnchecked({ring});
}

TEST(AreaInFramesTest, LayersThatArePlacedAlikeShareAConversion) {
  AreaInFrames area(Star(100), CellRule::kCentre);
  for (int i = 0; i < 50; ++i) {
    EXPECT_TRUE(area.Intersects(PlanarTransform(1, 2, 3), *Shape::MakePoint({1, 2})));
    EXPECT_FALSE(area.CoverIn(PlanarTransform(1, 2, 3), kGrid).bounds().empty());
  }
  EXPECT_EQ(area.num_polygons(), 1);
  EXPECT_EQ(area.num_covers(), 1);
  area.CoverIn(PlanarTransform(1, 2, 3), GridGeometry{PlanarTransform(), 0.25});
  area.CoverIn(PlanarTransform(1, 2, 0), kGrid);
  EXPECT_EQ(area.num_covers(), 3);
}

TEST(AreaInFramesTest, KeepsTheConversionsThatWereUsedLast) {
  AreaInFrames area(Star(100), CellRule::kCentre);
  const auto use = [&](double x) {
    area.Intersects(PlanarTransform(x, 0, 0), *Shape::MakePoint({0, 0}));
    return area.num_polygons();
  };
  for (size_t i = 0; i < AreaInFrames::kMaxKept; ++i) EXPECT_EQ(use(1.0 * i), i + 1);
  EXPECT_EQ(use(0), AreaInFrames::kMaxKept);
  EXPECT_EQ(use(-1), AreaInFrames::kMaxKept + 1);  // Takes the place of the second one.
  EXPECT_EQ(use(0), AreaInFrames::kMaxKept + 1);
  EXPECT_EQ(use(1), AreaInFrames::kMaxKept + 2);
}

TEST(AreaInFramesTest, AnswersAreThoseOfFreshConversionsWhateverTheirNumber) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const Polygon polygon = RandomPolygon(rng, {0, 0}, 6.0);
  AreaInFrames area(polygon, CellRule::kTouched);
  std::vector<PlanarTransform> places;
  for (size_t i = 0; i < 3 * AreaInFrames::kMaxKept; ++i) places.push_back(RandomTransform(rng, 5));
  for (int round = 0; round < 200; ++round) {
    const PlanarTransform& place =
        places[testing::UniformInt(rng, 0, static_cast<int>(places.size()) - 1)];
    const Polygon in_layer = place.Inverse() * polygon;
    const Shape shape = RandomObject(rng, {Uniform(rng, -8, 8), Uniform(rng, -8, 8)}, 2.0).shape;
    const bool intersects = PreparedPolygon(in_layer).Intersects(shape);
    EXPECT_EQ(area.Intersects(place, shape), intersects);
    // The box is only a first test.
    if (intersects) EXPECT_TRUE(area.BoundsIn(place).Intersects(shape.bounds()));
    const CellCover cover(in_layer, kGrid, kAllCells, CellRule::kTouched);
    EXPECT_EQ(area.CoverIn(place, kGrid).bounds(), cover.bounds());
    const int32_t row = cover.bounds().row_begin + round % 10;
    EXPECT_EQ(area.CoverIn(place, kGrid).SpansOfRow(row), cover.SpansOfRow(row));
  }
}

// Bytes that this thread has allocated; 0 if the allocator does not tell, as with a sanitizer.
int64_t Allocated() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<int64_t>(info.uordblks + info.hblkhd);
}

TEST(AreaInFramesTest, MemoryIsBoundedByTheEstimateWhateverTheFramesAndTheShapes) {
  const std::vector<Shape> shapes{*Shape::MakePoint({1, 2}), Star(50), Star(50'000)};
  for (const int vertices : {4, 40, 400, 10'000}) {
    const Polygon polygon = Star(vertices);
    const int64_t before = Allocated();
    AreaInFrames area(polygon, CellRule::kCentre);
    for (const Shape& shape : shapes) {
      // So many tests that GEOS takes part.
      const int num_tests = 200'000 / (vertices * shape.num_vertices()) + 2;
      for (int i = 0; i < 5; ++i) {
        const PlanarTransform place(1.0 * i, 0, 0.1);
        for (int test = 0; test < num_tests; ++test) area.Intersects(place, shape);
        area.CoverIn(place, kGrid).SpansOfRow(0);
        area.FreeExcess();
        EXPECT_LE(Allocated() - before, AreaInFrames::MaxBytes(polygon))
            << vertices << " vertices, " << shape.num_vertices() << " of the shape";
      }
      RecordProperty(absl::StrCat("bytes_of_", vertices, "_", shape.num_vertices()),
                     std::to_string(Allocated() - before));
    }
  }
}

}  // namespace
}  // namespace hypermap
