#include "storage/geopackage/change_log.h"

#include "base/status/status_macros.h"
#include "storage/encoding/change_columns.h"

namespace hypermap::storage {
namespace {

constexpr char kInsertObjectChange[] =
    "INSERT INTO hypermap_changes (revision, number, kind, lineage, object_id) "
    "VALUES (?, ?, ?, ?, ?)";

}  // namespace

absl::Status InsertChange(Database* database, Revision revision, int64_t number,
                          std::optional<int64_t> lineage, const Change& change) {
  HYPERMAP_ASSIGN_OR_RETURN(const ChangeColumns columns, EncodeChange(change));
  std::optional<int64_t> tile_column;
  std::optional<int64_t> tile_row;
  if (columns.tile) {
    const MatrixTile tile = ToMatrix(*columns.tile);
    tile_column = tile.column;
    tile_row = tile.row;
  }
  return database->Run(
      "INSERT INTO hypermap_changes (revision, number, kind, lineage, object_id, tile_column, "
      "tile_row, detail) VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
      revision, number, columns.kind, lineage, columns.object_id, tile_column, tile_row,
      columns.detail);
}

absl::Status InsertObjectPuts(Database* database, Revision revision, int64_t number,
                              int64_t lineage, absl::Span<const SemanticObject* const> objects) {
  HYPERMAP_ASSIGN_OR_RETURN(Statement insert, database->Prepare(kInsertObjectChange));
  for (const SemanticObject* object : objects) {
    HYPERMAP_RETURN_IF_ERROR(
        insert.Bind(revision, number++, kObjectPut, lineage, object->id).Run());
  }
  return absl::OkStatus();
}

absl::StatusOr<LoggedChange> ReadLoggedChange(Statement* row) {
  LoggedChange change;
  change.revision = row->Int64(0);
  change.kind = std::string(row->Text(1));
  change.lineage = row->OptionalInt64(2).value_or(0);
  change.object_id = row->OptionalInt64(3).value_or(0);
  change.tile.column = row->OptionalInt64(4).value_or(0);
  change.tile.row = row->OptionalInt64(5).value_or(0);
  if (!row->IsNull(6)) change.detail = std::string(row->Text(6));
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return change;
}

}  // namespace hypermap::storage
