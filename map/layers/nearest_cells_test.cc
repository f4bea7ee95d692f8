#include "map/layers/nearest_cells.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/cancellation/testing/cancelled_after.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::Lt;
using testing::RandomCells;
using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

std::shared_ptr<const GridLayer> EmptyOccupancy(const GridGeometry& geometry) {
  return std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(
      {.name = "grid", .kind = LayerKind::kOccupancy, .frame_id = "map", .grid = geometry}));
}

void Write(GridWriter* writer, const CellBox& box, double value) {
  const std::vector<std::optional<double>> values(box.num_cells(), value);
  ASSERT_TRUE(writer->Write(box, values).ok());
}

using Place = std::tuple<double, int32_t, int32_t>;  // Distance, row, column.

std::vector<Place> PlacesOf(const std::vector<Neighbour>& neighbours) {
  std::vector<Place> places;
  for (const Neighbour& n : neighbours) {
    EXPECT_EQ(n.cell.col_end, n.cell.col_begin + 1);
    places.emplace_back(n.distance_m, n.cell.row, n.cell.col_begin);
  }
  return places;
}

std::vector<Place> ByBruteForce(const GridLayer& grid, const Point& p, const CodePredicate& matches,
                                size_t k) {
  std::vector<Place> places;
  const CellBox& box = grid.extent();
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      if (!matches(grid.CodeAt({row, col}))) continue;
      places.emplace_back(DistanceToCentre(grid.geometry(), {row, col}, p), row, col);
    }
  }
  std::sort(places.begin(), places.end());
  places.resize(std::min(places.size(), k));
  return places;
}

// A few patches of cells in an extent of some tiles.
std::shared_ptr<const GridLayer> RandomPatches(Rng& rng, const GridGeometry& geometry) {
  GridWriter writer(EmptyOccupancy(geometry));
  const int num_patches = UniformInt(rng, 1, 4);
  for (int i = 0; i < num_patches; ++i) {
    const int32_t row = UniformInt(rng, -150, 120);
    const int32_t col = UniformInt(rng, -150, 120);
    const CellBox box{row, row + UniformInt(rng, 1, 60), col, col + UniformInt(rng, 1, 60)};
    EXPECT_TRUE(writer.Write(box, RandomCells(rng, LayerKind::kOccupancy, box)).ok());
  }
  return std::move(writer).Finish().layer;
}

Point RandomPoint(Rng& rng) {
  constexpr double kReaches_m[] = {1.0, 20.0, 1e3, 1e6, 1e9, 1e12, 1e16, 1e20, 1e30};
  const double reach = kReaches_m[UniformInt(rng, 0, std::size(kReaches_m) - 1)];
  const Point p{Uniform(rng, -reach, reach), Uniform(rng, -reach, reach)};
  // Also along the axes and diagonals, where distances tie.
  switch (UniformInt(rng, 0, 4)) {
    case 0:
      return {0.0, p.y};
    case 1:
      return {p.x, 0.0};
    case 2:
      return {p.x, p.x};
    default:
      return p;
  }
}

TEST(NearestCellsTest, EqualBruteForceFromNearAndFar) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 12; ++i) {
    constexpr double kResolutions_m[] = {1e-4, 0.05, 0.5, 1e4};
    const GridGeometry geometry{i % 3 == 0   ? PlanarTransform()
                                : i % 3 == 1 ? PlanarTransform(-15.4, 12.2, 0.0)
                                             : RandomTransform(rng, 1000.0),
                                kResolutions_m[i % 4]};
    const auto grid = RandomPatches(rng, geometry);
    for (const char* word : {"unknown", "occupied", "free"}) {
      const CodePredicate matches = *grid->domain().Match(*ParseValueQuery(word));
      for (int n = 0; n < 3; ++n) {
        const Point p = RandomPoint(rng);
        const int k = n == 0 ? 1 : UniformInt(rng, 1, 300);
        ASSERT_EQ(PlacesOf(NearestCells(*grid, p, matches, k)), ByBruteForce(*grid, p, matches, k))
            << word << " from " << p.x << ", " << p.y << ", k " << k << ", resolution "
            << geometry.resolution_m << ", yaw " << geometry.layer_from_grid.yaw();
      }
    }
  }
}

// The largest extent, with one known cell in each of two corners.
std::shared_ptr<const GridLayer> HugeGrid(const GridGeometry& geometry) {
  constexpr int32_t kM = kMaxCellIndex;
  GridWriter writer(EmptyOccupancy(geometry));
  Write(&writer, {-kM, -kM + 1, -kM, -kM + 1}, 0.9);
  Write(&writer, {kM - 1, kM, kM - 1, kM}, 0.9);
  return std::move(writer).Finish().layer;
}

// Returns the number of looks at its cancellation that the search takes: one for each box.
int64_t LooksFor(const GridLayer& grid, const Point& p, const char* word, int k,
                 std::vector<Place>* places = nullptr) {
  constexpr int64_t kMany = 1'000'000;
  const CodePredicate matches = *grid.domain().Match(*ParseValueQuery(word));
  const CancelledAfter looked(kMany);
  const auto neighbours = NearestCells(grid, p, matches, k);
  if (places != nullptr) *places = PlacesOf(neighbours);
  return looked.num_looks();
}

TEST(NearestCellsTest, FarPointsAreAnsweredAfterFewBoxesOfAHugeGrid) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (const GridGeometry& geometry :
       {GridGeometry{PlanarTransform(), 0.05}, GridGeometry{PlanarTransform(3, 4, 0.7), 0.05},
        GridGeometry{PlanarTransform(-1e5, 0, 0), 1e-4}, GridGeometry{PlanarTransform(), 1e4}}) {
    const auto grid = HugeGrid(geometry);
    // In a turned grid, all tiles of the side that faces the point may be equally far.
    const bool is_turned = geometry.layer_from_grid.yaw() != 0.0;
    const int64_t most = is_turned ? 2 * (2 * kMaxCellIndex / kTileSide) : 6000;
    for (const double far : {1e9, 1e12, 1e16, 1e20, 1e100}) {
      const double x = Uniform(rng, -far, far);
      for (const Point& p : {Point{far, far}, Point{-far, far}, Point{far, 0}, Point{0, far},
                             Point{0, -far}, Point{x, -far}}) {
        for (const char* word : {"unknown", "occupied"}) {
          for (const int k : {1, 1000}) {
            EXPECT_THAT(LooksFor(*grid, p, word, k), Lt(most))
                << word << " " << p.x << " " << p.y << ", k " << k << ", in cells of "
                << geometry.resolution_m << " m, yaw " << geometry.layer_from_grid.yaw();
          }
        }
      }
    }
  }
}

TEST(NearestCellsTest, OfCellsThatAreEquallyFarTheFirstIsTheNearest) {
  const auto grid = HugeGrid({PlanarTransform(), 0.05});
  std::vector<Place> places;
  // All cells are 1e30 m away.
  LooksFor(*grid, {1e30, 1e30}, "unknown", 2, &places);
  const double distance_m_of_all = DistanceToCentre(grid->geometry(), {0, 0}, {1e30, 1e30});
  EXPECT_THAT(places, ElementsAre(Place{distance_m_of_all, -kMaxCellIndex, -kMaxCellIndex + 1},
                                  Place{distance_m_of_all, -kMaxCellIndex, -kMaxCellIndex + 2}));
  // Distances are multiples of 16 km, so that the nearest rows are equally far.
  LooksFor(*grid, {0, 1e20}, "unknown", 1, &places);
  ASSERT_EQ(places.size(), 1u);
  const auto& [distance_m, row, col] = places.front();
  const auto distance_of = [&](int32_t r) {
    return DistanceToCentre(grid->geometry(), {r, 0}, {0, 1e20});
  };
  EXPECT_EQ(col, -kMaxCellIndex);
  EXPECT_EQ(distance_m, distance_of(kMaxCellIndex - 1));
  EXPECT_EQ(distance_of(row), distance_m);
  EXPECT_GT(distance_of(row - 1), distance_m);
}

TEST(NearestCellsTest, UnknownCellsOfASparseGridAreFoundAfterFewBoxes) {
  const auto grid = HugeGrid({PlanarTransform(), 0.05});
  const double corner = kMaxCellIndex * 0.05;
  for (const Point& p : {Point{0, 0}, Point{corner, corner}, Point{-corner, corner},
                         Point{corner - 0.025, corner - 0.025}, Point{2 * corner, corner}}) {
    std::vector<Place> places;
    EXPECT_THAT(LooksFor(*grid, p, "unknown", 1, &places), Lt(500)) << p.x << ", " << p.y;
    EXPECT_EQ(places.size(), 1u);
    EXPECT_THAT(LooksFor(*grid, p, "unknown", 1000, &places), Lt(1000)) << p.x << ", " << p.y;
    EXPECT_EQ(places.size(), 1000u);
  }
  std::vector<Place> places;
  LooksFor(*grid, {corner - 0.025, corner - 0.025}, "unknown", 1, &places);
  EXPECT_THAT(places, ElementsAre(Place{places.front()}));
  EXPECT_NEAR(std::get<0>(places.front()), 0.05, 1e-6);
}

TEST(NearestCellsTest, KnownCellsAmongManyTilesAreFoundAfterFewBoxes) {
  GridWriter writer(EmptyOccupancy({PlanarTransform(), 1.0}));
  // A thousand rows of tiles with two tiles each, and one row with a thousand.
  for (int32_t i = 0; i < 1000; ++i) {
    Write(&writer, {i * kTileSide, i * kTileSide + 1, 0, 1}, 0.9);
    Write(&writer, {i * kTileSide, i * kTileSide + 1, 100'000, 100'001}, 0.9);
    Write(&writer, {0, 1, i * kTileSide, i * kTileSide + 1}, 0.9);
  }
  const auto grid = std::move(writer).Finish().layer;
  for (const Point& p :
       {Point{70'000, 40'000}, Point{64'000, 3}, Point{-1e20, 0}, Point{0, 1e20}}) {
    std::vector<Place> places;
    // One look is for each row of tiles.
    EXPECT_THAT(LooksFor(*grid, p, "occupied", 1, &places), Lt(2500)) << p.x << ", " << p.y;
    const CodePredicate matches = *grid->domain().Match(*ParseValueQuery("occupied"));
    std::vector<Place> all;
    for (const auto& [index, tile] : grid->tiles()) {
      const CellBox cells = CellsOf(index);
      const CellIndex cell{cells.row_begin, index.col == 781 ? 100'000 : cells.col_begin};
      if (!matches(grid->CodeAt(cell))) continue;
      all.emplace_back(DistanceToCentre(grid->geometry(), cell, p), cell.row, cell.col);
    }
    EXPECT_THAT(places, ElementsAre(*std::min_element(all.begin(), all.end())));
  }
}

}  // namespace
}  // namespace hypermap
