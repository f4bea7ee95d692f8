// Grid layers: sparse, tiled, growing where they are written.
#ifndef HYPERMAP_MAP_LAYERS_GRID_LAYER_H_
#define HYPERMAP_MAP_LAYERS_GRID_LAYER_H_

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/grid/cell_cover.h"
#include "map/grid/cell_domain.h"
#include "map/grid/tile.h"
#include "map/layers/layer.h"

namespace hypermap {

// Ordered by row, then column.
using TileMap = absl::btree_map<TileIndex, TilePtr>;

// Bytes of memory that a tile of a grid takes, with its place in the TileMap of two versions: the
// next version is made beside the one before. 0 for null.
inline int64_t BytesInGrid(const Tile* tile) {
  constexpr int64_t kPlace = 2 * 36;
  constexpr int64_t kAllocation = 160;
  return tile == nullptr ? 0 : tile->ByteSize() + kAllocation + kPlace;
}

// A grid of one of the grid kinds; `domain` defines the meaning of its cells. The extent is the
// smallest box of all cells that were ever written (also as unknown). Cells in it that were never
// written are unknown; outside it the layer has no answer.
class GridLayer : public Layer {
 public:
  // An empty grid. `spec.grid` must be set.
  GridLayer(LayerSpec spec, std::shared_ptr<const CellDomain> domain);
  // A grid with content, which must lie in `extent`.
  GridLayer(LayerSpec spec, std::shared_ptr<const CellDomain> domain, TileMap tiles,
            CellBox extent);

  const GridGeometry& geometry() const { return *spec().grid; }
  const CellBox& extent() const { return extent_; }
  const TileMap& tiles() const { return tiles_; }
  const CellDomain& domain() const { return *domain_; }
  const std::shared_ptr<const CellDomain>& shared_domain() const { return domain_; }

  CellCode CodeAt(const CellIndex& cell) const;
  // Returns nullopt if the cell is unknown or outside the extent.
  std::optional<double> ValueAt(const CellIndex& cell) const;

  Box Bounds() const override;
  int64_t Size() const override { return extent_.num_cells(); }
  int64_t ByteSize() const override { return byte_size_; }
  using Layer::ContentAt;
  using Layer::ContentAtEach;
  // Returns the content of the cell that contains `p`; ignores the tolerance.
  PointContent ContentAt(const Point& p, double tolerance_m) const override;
  void ContentAtEach(absl::Span<const Point> points, double tolerance_m,
                     PointsContent* content) const override;
  std::unique_ptr<AnswerCursor> ContentIn(const Polygon& area) const override;
  std::unique_ptr<AnswerCursor> Find(const ValueQuery& value, const Polygon* area) const override;
  std::optional<std::vector<Neighbour>> Nearest(const Point& p, const ValueQuery& value,
                                                int k) const override;

 private:
  friend class GridWriter;

  // The next version of `before`.
  GridLayer(const GridLayer& before, TileMap tiles, CellBox extent, int64_t byte_size);

  std::shared_ptr<const CellDomain> domain_;
  TileMap tiles_;
  CellBox extent_;
  int64_t byte_size_;
};

// Writes cells into a copy of a grid. Copies only the tiles that it writes, and unpacks few of them
// at a time. Used by one thread.
class GridWriter {
 public:
  explicit GridWriter(std::shared_ptr<const GridLayer> layer);

  // Bytes by which the grid (GridLayer::ByteSize) has grown; may be negative. Tiles that are
  // unpacked count as they were when they were packed last.
  int64_t growth() const { return growth_; }
  // Makes Write and Fill fail as soon as growth() exceeds `bytes`: with RESOURCE_EXHAUSTED, after
  // which the writer must not be used any more.
  void LimitGrowth(int64_t bytes) { max_growth_ = bytes; }

  // Sets the cells of `box`. `values` is row-major, lowest row first; nullopt means unknown. The
  // extent grows to include the box. INVALID_ARGUMENT if the number of values does not fit, the box
  // is empty or exceeds kAllCells, or the kind does not have one of the values; then nothing is
  // written. Errors of LimitGrowth.
  absl::Status Write(const CellBox& box, const std::vector<std::optional<double>>& values);

  // Sets the cells that `area` (layer frame) selects by `rule`. The extent grows to include them.
  // INVALID_ARGUMENT if the area exceeds kAllCells or the kind does not have the value;
  // RESOURCE_EXHAUSTED if the bounding box of the selection has more than `max_cells` cells. Errors
  // of LimitGrowth.
  absl::Status Fill(const Polygon& area, CellRule rule, std::optional<double> value,
                    int64_t max_cells);

  // A written tile, before (null if new) and after.
  struct WrittenTile {
    TilePtr before;
    TilePtr after;
  };
  using WrittenTiles = absl::btree_map<TileIndex, WrittenTile>;

  // Finishes the copy. `written` leaves out tiles whose content did not change.
  struct Result {
    std::shared_ptr<const GridLayer> layer;
    WrittenTiles written;
  };
  Result Finish() &&;

 private:
  struct Dirty {
    TilePtr before;  // Null: all cells are unknown.
    // As it was packed last; `before` at first.
    TilePtr packed;
    // The codes now; null if they are those of `packed`.
    std::unique_ptr<TileCodes> codes;
  };
  class BandFill;

  Dirty& DirtyAt(const TileIndex& index);
  // Unpacks the tile; valid until the next call.
  TileCodes& MutableCodes(const TileIndex& index);
  // Gives all cells of a tile the same code.
  void SetUniform(const TileIndex& index, CellCode code);
  void SetPacked(TilePtr tile, Dirty* dirty);
  // Packs all tiles that are unpacked.
  void Pack();
  absl::Status CheckGrowth() const;

  std::shared_ptr<const GridLayer> layer_;
  absl::btree_map<TileIndex, Dirty> dirty_;
  std::vector<TileIndex> unpacked_;
  TilePtr uniform_;  // The newest one that SetUniform made, for many tiles.
  CellBox extent_;
  int64_t growth_ = 0;
  int64_t max_growth_ = std::numeric_limits<int64_t>::max();
};

// Returns the layer as a grid; null if it is null or has another kind.
const GridLayer* AsGrid(const Layer* layer);
std::shared_ptr<const GridLayer> AsGrid(const LayerPtr& layer);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_LAYER_H_
