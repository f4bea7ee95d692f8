#include "ingest/perception/testing/walled_room.h"

#include <cstdlib>
#include <utility>

#include "map/layers/layer_registry.h"

namespace hypermap::ingest::testing {
namespace {

// The walls are the columns kWallCol and -kWallCol - 1, and the rows kWallRow and -kWallRow - 1.
constexpr int kWallCol = 60;
constexpr int kWallRow = 40;
constexpr CellBox kCells{-kWallRow - 1, kWallRow + 1, -kWallCol - 1, kWallCol + 1};

std::shared_ptr<const GridLayer> Grid(bool walls) {
  const LayerSpec spec{.name = "occupancy",
                       .kind = LayerKind::kOccupancy,
                       .frame_id = "map",
                       .grid = GridGeometry{PlanarTransform(), 0.05}};
  std::vector<std::optional<double>> values;
  for (int row = kCells.row_begin; row < kCells.row_end; ++row) {
    for (int col = kCells.col_begin; col < kCells.col_end; ++col) {
      const bool wall =
          row == kCells.row_begin || row == kWallRow || col == kCells.col_begin || col == kWallCol;
      values.push_back(walls && wall ? 1.0 : 0.0);
    }
  }
  GridWriter writer(std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(spec)));
  if (!writer.Write(kCells, values).ok()) std::abort();
  return std::move(writer).Finish().layer;
}

}  // namespace

BoxScene WalledRoom() {
  return {true,
          {{{3.025, -3, 0}, {3.2, 3, 2.5}},
           {{-3.2, -3, 0}, {-3.025, 3, 2.5}},
           {{-3.2, 2.025, 0}, {3.2, 2.2, 2.5}},
           {{-3.2, -2.2, 0}, {3.2, -2.025, 2.5}}}};
}

std::shared_ptr<const GridLayer> WalledRoomGrid() { return Grid(true); }

std::shared_ptr<const GridLayer> GridWithoutWalls() { return Grid(false); }

}  // namespace hypermap::ingest::testing
