// The tiles of any kept revision. Tiles that were rewritten since come from the history, those that
// are unchanged from the table of their layer.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TILE_VERSIONS_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TILE_VERSIONS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"
#include "storage/cache_room.h"
#include "storage/encoding/tile_codec.h"
#include "storage/generation_cache.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/tile_matrix.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Borrows the database. Several reads are consistent only within one ReadTransaction. Errors: those
// of Statement, those of TakeMemory for what is read, and DATA_LOSS naming the table and the tile.
class TileVersions {
 public:
  TileVersions(Database* database, CacheRoomPtr room)
      : database_(database), cache_(std::move(room)) {}

  // The tile at the revision; null when it did not exist then.
  absl::StatusOr<TilePtr> At(const Lineage& layer, const MatrixTile& place, Revision revision);

  // The tiles that share a cell with `cells`.
  absl::StatusOr<TileMap> InBox(const Lineage& layer, const CellBox& cells, Revision revision);

 private:
  // Memory of a tile's places in the cache and in an answer.
  static constexpr int64_t kBytesOfPlaces = 256;
  // Lineage, column, row, and the revision that ended it, or that made the one that is there now.
  using Key = std::tuple<int64_t, int64_t, int64_t, Revision, bool>;
  using Place = std::pair<int64_t, int64_t>;  // column, row
  struct Range {
    MatrixTile first;
    MatrixTile last;
  };

  absl::StatusOr<TilePtr> Current(const Lineage& layer, const MatrixTile& place);
  absl::StatusOr<TilePtr> Decode(const Key& key, LayerKind kind, absl::string_view image,
                                 const char* table);
  // Add the places in the range that have a tile in the history, or in the layer's table.
  absl::Status AddReplaced(const Lineage& layer, const Range& range, std::set<Place>* places);
  absl::Status AddCurrent(const Lineage& layer, const Range& range, std::set<Place>* places);

  Database* database_;
  std::map<LayerKind, std::unique_ptr<const TileCodec>> codecs_;
  GenerationCache<Key, TilePtr> cache_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TILE_VERSIONS_H_
