// The tiles of any kept revision: those that were rewritten since, from the history, and those that
// still are as they were, from their layer's table.
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
#include "map/layers/grid/grid_layer.h"
#include "map/snapshot.h"
#include "storage/geopackage/generation_cache.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/tile_codec.h"
#include "storage/geopackage/tile_matrix.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Borrows the database. What it reads belongs to one moment only within a ReadTransaction. All
// errors are as of Statement, and DATA_LOSS naming the table and the tile.
class TileVersions {
 public:
  explicit TileVersions(Database* database) : database_(database), cache_(kCachedTiles) {}

  // As it was at the revision; null when it was not there.
  absl::StatusOr<TilePtr> At(const Lineage& layer, const MatrixTile& place, Revision revision);

  // Those that share a cell with `cells`.
  absl::StatusOr<TileMap> InBox(const Lineage& layer, const CellBox& cells, Revision revision);

 private:
  static constexpr size_t kCachedTiles = 256;
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
  // Adds the places in the range that ever had a tile.
  absl::Status AddReplaced(const Lineage& layer, const Range& range, std::set<Place>* places);
  absl::Status AddCurrent(const Lineage& layer, const Range& range, std::set<Place>* places);

  Database* database_;
  std::map<LayerKind, std::unique_ptr<const TileCodec>> codecs_;
  GenerationCache<Key, TilePtr> cache_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TILE_VERSIONS_H_
