#include "storage/postgres/tile_versions.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::storage::postgres {
namespace {

// The tiles of the rows $3 to $4 and columns $5 to $6 at the revision $7, with the images of the
// first of them, which have up to $8 bytes together. It steps from place to place in the index and
// over columns outside of the box, so that neither other tiles nor the number of versions of a tile
// cost anything.
constexpr char kTilesInBox[] = R"sql(
WITH RECURSIVE place AS (
  (SELECT tile_row, tile_col FROM hypermap.tiles
     WHERE map = $1 AND lineage = $2 AND (tile_row, tile_col) >= ($3, $5)
     ORDER BY tile_row, tile_col LIMIT 1)
  UNION ALL
  SELECT next.tile_row, next.tile_col
    FROM place CROSS JOIN LATERAL (
      SELECT tile_row, tile_col FROM hypermap.tiles
        WHERE map = $1 AND lineage = $2 AND (tile_row, tile_col) >= (
          CASE WHEN place.tile_col < $6 THEN place.tile_row ELSE place.tile_row + 1 END,
          CASE WHEN place.tile_col BETWEEN $5 AND $6 - 1 THEN place.tile_col + 1 ELSE $5 END)
        ORDER BY tile_row, tile_col LIMIT 1) AS next
    WHERE place.tile_row <= $4)
SELECT tile_row, tile_col, first_revision, end_revision, bytes,
    CASE WHEN sum(bytes) OVER (ORDER BY tile_row, tile_col) <= $8 THEN image END
  FROM (
    SELECT place.tile_row, place.tile_col, t.first_revision, t.end_revision,
        octet_length(t.image) AS bytes, t.image
      FROM place CROSS JOIN LATERAL (
        SELECT first_revision, end_revision, image FROM hypermap.tiles
          WHERE map = $1 AND lineage = $2 AND tile_row = place.tile_row
            AND tile_col = place.tile_col AND end_revision > $7
          ORDER BY end_revision LIMIT 1) AS t
      WHERE place.tile_row <= $4 AND place.tile_col BETWEEN $5 AND $6 AND t.first_revision <= $7
    ) AS found
)sql";

// The same for the places of row $3 and column $4, and so on, at the revision $5, with up to $6
// bytes of images.
constexpr char kTilesAt[] = R"sql(
SELECT p.tile_row, p.tile_col, t.first_revision, t.end_revision, t.bytes,
    CASE WHEN sum(t.bytes) OVER (ORDER BY p.tile_row, p.tile_col) <= $6 THEN t.image END
  FROM unnest($3::int8[], $4::int8[]) AS p(tile_row, tile_col)
  CROSS JOIN LATERAL (
    SELECT first_revision, end_revision, octet_length(image) AS bytes, image FROM hypermap.tiles
      WHERE map = $1 AND lineage = $2 AND tile_row = p.tile_row AND tile_col = p.tile_col
        AND end_revision > $5
      ORDER BY end_revision LIMIT 1) AS t
  WHERE t.first_revision <= $5
)sql";
// More places than these are found by kTilesInBox, which looks only at those that have tiles.
constexpr int64_t kFewPlaces = 64;

// The lateral query, with its limit, is run for each version: the planner can't choose to read the
// whole table instead.
constexpr char kFetchTiles[] = R"sql(
SELECT v.number, t.image
  FROM unnest($2::int8[], $3::int8[], $4::int8[], $5::int8[]) WITH ORDINALITY
    AS v(lineage, tile_row, tile_col, end_revision, number)
  CROSS JOIN LATERAL (
    SELECT image FROM hypermap.tiles
      WHERE map = $1 AND lineage = v.lineage AND tile_row = v.tile_row AND tile_col = v.tile_col
        AND end_revision = v.end_revision LIMIT 1) AS t
)sql";

}  // namespace

std::string TileVersion::Name() const {
  return absl::StrCat("hypermap.tiles, lineage ", lineage, ", tile_row ", index.row, ", tile_col ",
                      index.col, ", version ", first_revision);
}

TilePlaces PlacesIn(const CellBox& cells) {
  const CellBox box = cells.Intersection(kAllCells);
  if (box.empty()) return {};
  return {TileOf({box.row_begin, box.col_begin}), TileOf({box.row_end - 1, box.col_end - 1})};
}

absl::StatusOr<TileIndex> ToTileIndex(int64_t row, int64_t col) {
  constexpr int64_t kSide = kMaxCellIndex / kTileSide;
  if (std::min(row, col) < -kSide || std::max(row, col) >= kSide) {
    return absl::DataLossError(
        absl::StrCat("hypermap.tiles has a tile at tile_row ", row, ", tile_col ", col));
  }
  return TileIndex{static_cast<int32_t>(row), static_cast<int32_t>(col)};
}

void TileVersions::AskInBox(Pipeline& pipeline, int64_t lineage, const CellBox& cells,
                            Revision revision) const {
  const TilePlaces places = PlacesIn(cells);
  const auto& [low, high] = places;
  if (places.count() <= kFewPlaces) {
    std::vector<int64_t> tile_rows, tile_cols;
    for (int64_t row = low.row; row <= high.row; ++row) {
      for (int64_t col = low.col; col <= high.col; ++col) {
        tile_rows.push_back(row);
        tile_cols.push_back(col);
      }
    }
    pipeline.Ask(kTilesAt, map_, lineage, absl::MakeConstSpan(tile_rows),
                 absl::MakeConstSpan(tile_cols), revision, kBytesAtOnce);
    return;
  }
  pipeline.Ask(kTilesInBox, map_, lineage, int64_t{low.row}, int64_t{high.row}, int64_t{low.col},
               int64_t{high.col}, revision, kBytesAtOnce);
}

absl::StatusOr<TileMap> TileVersions::ReadInBox(GetConnection connection, int64_t lineage,
                                                LayerKind kind, Rows rows) {
  constexpr int kImage = 5;
  TileMap tiles;
  Cache::Reading reading(&cache_);
  std::vector<TileIndex> indexes;
  while (rows.Next()) {
    HYPERMAP_ASSIGN_OR_RETURN(const TileIndex index, ToTileIndex(rows.Int64(0), rows.Int64(1)));
    const TileVersion version{lineage, kind, index, rows.Int64(2), rows.Int64(3), rows.Int64(4)};
    HYPERMAP_RETURN_IF_ERROR(rows.row_status());
    HYPERMAP_RETURN_IF_ERROR(rows.IsNull(kImage) ? reading.Add(version) : reading.Add(version, [&] {
      return Decode(kind, rows.Blob(kImage));
    }));
    indexes.push_back(index);
  }
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<TilePtr> read, Finish(connection, &reading));
  for (size_t i = 0; i < read.size(); ++i) tiles.emplace(indexes[i], std::move(read[i]));
  return tiles;
}

absl::StatusOr<std::vector<TilePtr>> TileVersions::Read(Connection& connection,
                                                        absl::Span<const TileVersion> versions) {
  Cache::Reading reading(&cache_);
  for (const TileVersion& version : versions) HYPERMAP_RETURN_IF_ERROR(reading.Add(version));
  return Finish([&] { return &connection; }, &reading);
}

absl::StatusOr<std::vector<TilePtr>> TileVersions::Finish(GetConnection connection,
                                                          Cache::Reading* reading) {
  return reading->Finish(
      [&](absl::Span<const TileVersion> batch, Cache::Take take) -> absl::Status {
        std::vector<int64_t> lineages, tile_rows, tile_cols, ends;
        for (const TileVersion& version : batch) {
          lineages.push_back(version.lineage);
          tile_rows.push_back(version.index.row);
          tile_cols.push_back(version.index.col);
          ends.push_back(version.end_revision);
        }
        HYPERMAP_ASSIGN_OR_RETURN(Connection* const idle, connection());
        HYPERMAP_ASSIGN_OR_RETURN(
            Rows rows, idle->Query(kFetchTiles, map_, absl::MakeConstSpan(lineages),
                                   absl::MakeConstSpan(tile_rows), absl::MakeConstSpan(tile_cols),
                                   absl::MakeConstSpan(ends)));
        while (rows.Next()) {
          const size_t number = static_cast<size_t>(rows.Int64(0) - 1);
          const absl::string_view image = rows.Blob(1);
          HYPERMAP_RETURN_IF_ERROR(rows.row_status());
          HYPERMAP_RETURN_IF_ERROR(take(number, Decode(batch.at(number).kind, image)));
        }
        return absl::OkStatus();
      });
}

absl::StatusOr<TilePtr> TileVersions::Decode(LayerKind kind, absl::string_view image) {
  std::unique_ptr<const TileCodec>& codec = codecs_[kind];
  if (codec == nullptr) codec = MakeTileCodec(kind);
  if (codec == nullptr) return absl::DataLossError("the layer is not a grid");
  return codec->Decode(image);
}

}  // namespace hypermap::storage::postgres
