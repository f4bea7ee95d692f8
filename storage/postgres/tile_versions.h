// The tiles of any kept revision.
#ifndef HYPERMAP_STORAGE_POSTGRES_TILE_VERSIONS_H_
#define HYPERMAP_STORAGE_POSTGRES_TILE_VERSIONS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"
#include "storage/cache_room.h"
#include "storage/encoding/tile_codec.h"
#include "storage/libpq/connection.h"
#include "storage/postgres/version_cache.h"

namespace hypermap::storage::postgres {

// A row of hypermap.tiles.
struct TileVersion {
  int64_t lineage = 0;
  LayerKind kind = LayerKind::kOccupancy;  // of the layer
  TileIndex index;
  Revision first_revision = 0;
  Revision end_revision = 0;
  int64_t bytes = 0;  // of the image

  std::tuple<int64_t, TileIndex, Revision> key() const { return {lineage, index, first_revision}; }
  std::string Name() const;
  static int64_t BytesOf(const TilePtr& tile) { return tile->ByteSize(); }
};

// The places from `low` to `high`; none if high.row < low.row.
struct TilePlaces {
  TileIndex low{0, 0};
  TileIndex high{-1, -1};

  int64_t count() const {
    return (int64_t{high.row} - low.row + 1) * (int64_t{high.col} - low.col + 1);
  }
};
// The places of the tiles that share a cell with `cells`, as far as there are cells.
TilePlaces PlacesIn(const CellBox& cells);

// The place of a row of hypermap.tiles. DATA_LOSS when no grid has such a tile.
absl::StatusOr<TileIndex> ToTileIndex(int64_t row, int64_t col);

// As ObjectVersions.
class TileVersions {
 public:
  TileVersions(int64_t map, CacheRoomPtr room) : map_(map), cache_(std::move(room)) {}

  // Asks for the tiles that share a cell with `cells`. REQUIRES: PlacesIn has some.
  void AskInBox(Pipeline& pipeline, int64_t lineage, const CellBox& cells, Revision revision) const;
  // These tiles of a layer of that kind, given the rows of AskInBox. Uses the connection only if
  // not all content came with them.
  absl::StatusOr<TileMap> ReadInBox(GetConnection connection, int64_t lineage, LayerKind kind,
                                    Rows rows);

  // The tiles of different versions, in their order. The number of statements is small: one for
  // some megabytes.
  absl::StatusOr<std::vector<TilePtr>> Read(Connection& connection,
                                            absl::Span<const TileVersion> versions);

 private:
  using Cache = VersionCache<TileVersion, TilePtr>;
  absl::StatusOr<std::vector<TilePtr>> Finish(GetConnection connection, Cache::Reading* reading);
  absl::StatusOr<TilePtr> Decode(LayerKind kind, absl::string_view image);

  const int64_t map_;
  std::map<LayerKind, std::unique_ptr<const TileCodec>> codecs_;
  Cache cache_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_TILE_VERSIONS_H_
