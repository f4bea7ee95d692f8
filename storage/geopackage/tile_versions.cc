#include "storage/geopackage/tile_versions.h"

#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

constexpr char kHistoryTable[] = "hypermap_tile_history";

constexpr char kReplacedAt[] =
    "SELECT end_revision, tile_data FROM hypermap_tile_history "
    "WHERE lineage = ? AND tile_column = ? AND tile_row = ? AND end_revision > ? "
    "ORDER BY end_revision LIMIT 1";
constexpr char kLastReplaced[] =
    "SELECT max(end_revision) FROM hypermap_tile_history "
    "WHERE lineage = ? AND tile_column = ? AND tile_row = ?";
// The first place at or after a given one, ordered by column and row.
constexpr char kNextPlace[] =
    "SELECT tile_column, tile_row FROM hypermap_tile_history "
    "WHERE lineage = ? AND (tile_column, tile_row) >= (?, ?) "
    "ORDER BY tile_column, tile_row LIMIT 1";

// $t stands for the table's name, which needs no escapes (IsLayerTableName).
constexpr char kCurrentTile[] = R"sql(
SELECT tile_data FROM "$t" WHERE zoom_level = 0 AND tile_column = ? AND tile_row = ?
)sql";
constexpr char kCurrentPlaces[] = R"sql(
SELECT tile_column, tile_row FROM "$t"
  WHERE zoom_level = 0 AND tile_column BETWEEN ? AND ? AND tile_row BETWEEN ? AND ?
)sql";

}  // namespace

absl::StatusOr<TilePtr> TileVersions::Decode(const Key& key, LayerKind kind,
                                             absl::string_view image, const char* table) {
  if (TilePtr known = cache_.Find(key)) {
    HYPERMAP_RETURN_IF_ERROR(TakeMemory(kBytesOfPlaces + known->ByteSize()));
    return known;
  }
  std::unique_ptr<const TileCodec>& codec = codecs_[kind];
  if (codec == nullptr) codec = MakeTileCodec(kind);
  absl::StatusOr<TilePtr> tile = codec->Decode(image);
  if (!tile.ok()) {
    return absl::DataLossError(absl::StrCat("table ", table, ", tile_column ", std::get<1>(key),
                                            ", tile_row ", std::get<2>(key), ": ",
                                            tile.status().message()));
  }
  const int64_t bytes = kBytesOfPlaces + (*tile)->ByteSize();
  HYPERMAP_RETURN_IF_ERROR(TakeMemory(bytes));
  cache_.Insert(key, *tile, bytes);
  return tile;
}

absl::StatusOr<TilePtr> TileVersions::At(const Lineage& layer, const MatrixTile& place,
                                         Revision revision) {
  const int64_t lineage = layer.stored.lineage;
  HYPERMAP_ASSIGN_OR_RETURN(Statement replaced, database_->Prepare(kReplacedAt));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row,
                            replaced.Bind(lineage, place.column, place.row, revision).Step());
  if (!has_row) return layer.is_current ? Current(layer, place) : TilePtr();
  if (replaced.IsNull(1)) return TilePtr();
  const Key key{lineage, place.column, place.row, replaced.Int64(0), false};
  const absl::string_view image = replaced.Blob(1);
  HYPERMAP_RETURN_IF_ERROR(replaced.row_status());
  return Decode(key, layer.stored.spec.kind, image, kHistoryTable);
}

absl::StatusOr<TilePtr> TileVersions::Current(const Lineage& layer, const MatrixTile& place) {
  const StoredLayer& stored = layer.stored;
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database_->Prepare(absl::StrReplaceAll(
                                                  kCurrentTile, {{"$t", stored.table}})));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(place.column, place.row).Step());
  if (!has_row) return TilePtr();
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> since,
      database_->QueryInt64(kLastReplaced, stored.lineage, place.column, place.row));
  Revision version = since.value_or(0);
  if (!since) {
    // The tile was written before the oldest kept revision. A newer write of any tile would have
    // changed the layer's version.
    HYPERMAP_ASSIGN_OR_RETURN(const Revision newest, NewestRevisionOf(database_, stored.lineage));
    version = newest;
  }
  const absl::string_view image = select.Blob(0);
  HYPERMAP_RETURN_IF_ERROR(select.row_status());
  return Decode({stored.lineage, place.column, place.row, version, true}, stored.spec.kind, image,
                stored.table.c_str());
}

absl::Status TileVersions::AddReplaced(const Lineage& layer, const Range& range,
                                       std::set<Place>* places) {
  const auto& [first, last] = range;
  HYPERMAP_ASSIGN_OR_RETURN(Statement next, database_->Prepare(kNextPlace));
  // Steps from place to place in the index, so that the number of versions of a tile costs nothing.
  MatrixTile from = first;
  while (from.column <= last.column) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row,
                              next.Bind(layer.stored.lineage, from.column, from.row).Step());
    if (!has_row) break;
    const MatrixTile place{next.Int64(0), next.Int64(1)};
    HYPERMAP_RETURN_IF_ERROR(next.row_status());
    next.Reset();
    if (place.row > last.row) {
      from = {place.column + 1, first.row};
    } else if (place.row < first.row) {
      from = {place.column, first.row};
    } else {
      if (place.column <= last.column) places->emplace(place.column, place.row);
      from = {place.column, place.row + 1};
    }
  }
  return absl::OkStatus();
}

absl::Status TileVersions::AddCurrent(const Lineage& layer, const Range& range,
                                      std::set<Place>* places) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement select, database_->Prepare(absl::StrReplaceAll(
                                                  kCurrentPlaces, {{"$t", layer.stored.table}})));
  select.Bind(range.first.column, range.last.column, range.first.row, range.last.row);
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return absl::OkStatus();
    places->emplace(select.Int64(0), select.Int64(1));
    HYPERMAP_RETURN_IF_ERROR(select.row_status());
  }
}

absl::StatusOr<TileMap> TileVersions::InBox(const Lineage& layer, const CellBox& cells,
                                            Revision revision) {
  TileMap tiles;
  const CellBox box = cells.Intersection(kAllCells);
  if (box.empty()) return tiles;
  // Rows of tiles are counted downwards.
  const MatrixTile low = ToMatrix(TileOf({box.row_begin, box.col_begin}));
  const MatrixTile high = ToMatrix(TileOf({box.row_end - 1, box.col_end - 1}));
  const Range range{{low.column, high.row}, {high.column, low.row}};
  std::set<Place> places;
  HYPERMAP_RETURN_IF_ERROR(AddReplaced(layer, range, &places));
  if (layer.is_current) {
    HYPERMAP_RETURN_IF_ERROR(AddCurrent(layer, range, &places));
  }
  for (const auto& [column, row] : places) {
    const MatrixTile place{column, row};
    if (!IsInMatrix(place)) return absl::DataLossError("a tile outside of the tile matrix");
    HYPERMAP_ASSIGN_OR_RETURN(TilePtr tile, At(layer, place, revision));
    if (tile != nullptr) tiles.emplace(FromMatrix(place), std::move(tile));
  }
  return tiles;
}

}  // namespace hypermap::storage
