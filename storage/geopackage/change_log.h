// hypermap_changes: the changes of each commit in their order, with the columns of
// storage/encoding/change_columns.h.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_LOG_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_LOG_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/edits/change.h"
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

// Inserts one change; `number` is its place in the commit.
absl::Status InsertChange(Database* database, Revision revision, int64_t number,
                          std::optional<int64_t> lineage, const Change& change);

// Inserts the puts of objects of one layer; the first has the place `number` in the commit.
absl::Status InsertObjectPuts(Database* database, Revision revision, int64_t number,
                              int64_t lineage, absl::Span<const SemanticObject* const> objects);

inline constexpr char kLoggedChangeColumns[] =
    "revision, kind, lineage, object_id, tile_column, tile_row, detail";
// Reads a row of kLoggedChangeColumns. DATA_LOSS.
absl::StatusOr<LoggedChange> ReadLoggedChange(Statement* row);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_CHANGE_LOG_H_
