#include "storage/geopackage/grid_table.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/for_table.h"
#include "storage/geopackage/foreign_writes.h"
#include "storage/geopackage/tile_matrix.h"

namespace hypermap::storage {
namespace {

// $t stands for the table's name, which is plain (IsLayerTableName).
constexpr char kCreateGridTable[] = R"sql(
CREATE TABLE "$t" (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  zoom_level INTEGER NOT NULL,
  tile_column INTEGER NOT NULL,
  tile_row INTEGER NOT NULL,
  tile_data BLOB NOT NULL,
  UNIQUE (zoom_level, tile_column, tile_row)
);
)sql";

// An update keeps the id of the tile, to which gpkg_2d_gridded_tile_ancillary refers.
constexpr char kWriteTile[] = R"sql(
INSERT INTO "$t" (zoom_level, tile_column, tile_row, tile_data) VALUES (?, ?, ?, ?)
  ON CONFLICT (zoom_level, tile_column, tile_row) DO UPDATE SET tile_data = excluded.tile_data
  RETURNING id
)sql";

// The archived image is NULL when there was no tile.
constexpr char kArchiveTile[] = R"sql(
INSERT INTO hypermap_tile_history (lineage, tile_column, tile_row, end_revision, tile_data)
  VALUES (?1, ?2, ?3, ?4, (SELECT tile_data FROM "$t"
    WHERE zoom_level = 0 AND tile_column = ?2 AND tile_row = ?3))
)sql";
constexpr char kArchiveAllTiles[] = R"sql(
INSERT INTO hypermap_tile_history (lineage, tile_column, tile_row, end_revision, tile_data)
  SELECT ?1, tile_column, tile_row, ?2, tile_data FROM "$t" WHERE zoom_level = 0
)sql";

constexpr char kReadTiles[] = R"sql(
SELECT t.id, t.zoom_level, t.tile_column, t.tile_row, t.tile_data, a.scale, a.offset
  FROM "$t" AS t
  LEFT JOIN gpkg_2d_gridded_tile_ancillary AS a ON a.tpudt_name = '$t' AND a.tpudt_id = t.id
)sql";

absl::StatusOr<GridTable::PlacedTile> ReadRow(Statement* row, const TileCodec& codec,
                                              const CellBox& extent) {
  const int64_t zoom_level = row->Int64(1);
  const MatrixTile place{row->Int64(2), row->Int64(3)};
  const absl::string_view image = row->Blob(4);
  // GeoPackage allows each tile a scale and offset of its own, which Hypermap never writes.
  const double scale = row->Double(5);
  const double offset = row->Double(6);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  if (zoom_level != kZoomLevel || !IsInMatrix(place)) {
    return absl::DataLossError("the tile lies outside of the tile matrix");
  }
  if (scale != 1.0 || offset != 0.0) {
    return absl::DataLossError("the tile has a scale or offset of its own");
  }
  HYPERMAP_ASSIGN_OR_RETURN(TilePtr tile, codec.Decode(image));
  const TileIndex index = FromMatrix(place);
  if (!KnownOnlyIn(extent, index, *tile)) {
    return absl::DataLossError("the tile has known cells outside of the layer's extent");
  }
  return GridTable::PlacedTile(index, std::move(tile));
}

}  // namespace

GridTable::GridTable(Database* database, std::string table, int64_t lineage,
                     std::unique_ptr<const TileCodec> codec)
    : database_(database),
      table_(std::move(table)),
      lineage_(lineage),
      codec_(std::move(codec)),
      write_sql_(ForTable(kWriteTile, table_)),
      archive_sql_(ForTable(kArchiveTile, table_)) {}

absl::Status GridTable::Create() {
  HYPERMAP_RETURN_IF_ERROR(database_->Execute(ForTable(kCreateGridTable, table_)));
  return WatchForForeignWrites(database_, table_);
}

absl::Status GridTable::Drop(Revision revision) {
  HYPERMAP_RETURN_IF_ERROR(database_->Run(ForTable(kArchiveAllTiles, table_), lineage_, revision));
  // Cached statements would keep resources of the dropped table.
  database_->ForgetStatements();
  return database_->Execute(ForTable(R"sql(DROP TABLE "$t")sql", table_));
}

absl::Status GridTable::Write(const TileIndex& index, const Tile& tile, Revision revision) {
  const MatrixTile place = ToMatrix(index);
  if (!IsInMatrix(place)) return absl::InternalError("a tile outside of the tile matrix");
  HYPERMAP_ASSIGN_OR_RETURN(std::string image, codec_->Encode(tile));
  HYPERMAP_RETURN_IF_ERROR(
      database_->Run(archive_sql_, lineage_, place.column, place.row, revision));
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> id,
      database_->QueryInt64(write_sql_, kZoomLevel, place.column, place.row, BlobView{image}));
  return database_->Run(
      "INSERT OR IGNORE INTO gpkg_2d_gridded_tile_ancillary (tpudt_name, tpudt_id) VALUES (?, ?)",
      table_, id);
}

absl::Status GridTable::ForEach(const CellBox& extent, Visit visit) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database_->Prepare(ForTable(kReadTiles, table_)));
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    absl::StatusOr<PlacedTile> tile = ReadRow(&select, *codec_, extent);
    if (!tile.ok()) tile = absl::DataLossError(tile.status().message());
    HYPERMAP_RETURN_IF_ERROR(visit(select.Int64(0), std::move(tile)));
  }
}

absl::StatusOr<TileMap> GridTable::ReadAll(const CellBox& extent) {
  TileMap tiles;
  const absl::Status status =
      ForEach(extent, [&](int64_t id, absl::StatusOr<PlacedTile> tile) -> absl::Status {
        if (!tile.ok()) {
          return absl::DataLossError(
              absl::StrCat("table ", table_, ", id ", id, ": ", tile.status().message()));
        }
        tiles.insert(*std::move(tile));
        return absl::OkStatus();
      });
  HYPERMAP_RETURN_IF_ERROR(status);
  return tiles;
}

}  // namespace hypermap::storage
