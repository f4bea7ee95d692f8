// The table of one grid layer: a GeoPackage tile pyramid of one level, as a tiled gridded coverage.
// Tiles that a revision replaces or removes are copied to hypermap_tile_history.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_GRID_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_GRID_TABLE_H_

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"
#include "storage/encoding/tile_codec.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Borrows the database.
class GridTable {
 public:
  GridTable(Database* database, std::string table, int64_t lineage,
            std::unique_ptr<const TileCodec> codec);

  const CoverageCoding& coding() const { return codec_->coding(); }

  absl::Status Create();
  // Copies all tiles to the history and drops the table.
  absl::Status Drop(Revision revision);

  // Adds or replaces a tile.
  absl::Status Write(const TileIndex& index, const Tile& tile, Revision revision);

  // Reads all tiles. DATA_LOSS naming the table and the row of a tile that can't be decoded, has
  // another scale or offset than ours, or has known cells outside of `extent`.
  absl::StatusOr<TileMap> ReadAll(const CellBox& extent);

  // Calls `visit` with the id and the tile of each row, or with the DATA_LOSS of ReadAll, until it
  // returns an error.
  using PlacedTile = std::pair<TileIndex, TilePtr>;
  using Visit = absl::FunctionRef<absl::Status(int64_t id, absl::StatusOr<PlacedTile> tile)>;
  absl::Status ForEach(const CellBox& extent, Visit visit);

 private:
  Database* database_;
  std::string table_;
  int64_t lineage_;
  std::unique_ptr<const TileCodec> codec_;
  std::string write_sql_;
  std::string archive_sql_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_GRID_TABLE_H_
