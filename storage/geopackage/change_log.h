// hypermap_changes: what each commit did, in its order. Objects and tiles are named only; how they
// were and are is in their history. The rest is told whole, in `detail`.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_LOG_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_LOG_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/edits/change.h"
#include "storage/geopackage/layer_history.h"
#include "storage/geopackage/tile_matrix.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// A row of the table.
struct LoggedChange {
  Revision revision = 0;
  std::string kind;
  int64_t lineage = 0;  // 0: of no layer
  ObjectId object_id = 0;
  MatrixTile tile;
  std::string detail;  // JSON
};

inline constexpr char kObjectPut[] = "put";
inline constexpr char kObjectRemoved[] = "remove";
inline constexpr char kTileWritten[] = "tile";

// `number` is its place in the commit.
absl::Status InsertChange(Database* database, Revision revision, int64_t number,
                          std::optional<int64_t> lineage, const Change& change);

// The same of objects of one layer that were put, the first of them in the place `number`.
absl::Status InsertObjectPuts(Database* database, Revision revision, int64_t number,
                              int64_t lineage, absl::Span<const SemanticObject* const> objects);

// Columns: kLoggedChangeColumns. DATA_LOSS.
inline constexpr char kLoggedChangeColumns[] =
    "revision, kind, lineage, object_id, tile_column, tile_row, detail";
absl::StatusOr<LoggedChange> ReadLoggedChange(Statement* row);

// The change of a row that is neither of an object nor of a tile; `layer` is that of its lineage.
// DATA_LOSS.
absl::StatusOr<Change> DecodeStructureChange(const LoggedChange& logged, const StoredLayer& layer);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_LOG_H_
