#include "storage/postgres/object_row.h"

#include "base/status/status_macros.h"
#include "storage/encoding/object_columns.h"

namespace hypermap::storage::postgres {

absl::StatusOr<ObjectPtr> ReadObjectRow(Rows* row, int first_column) {
  int column = first_column;
  ObjectColumns columns;
  columns.id = row->Int64(column++);
  columns.version = row->Int64(column++);
  columns.shape = row->Blob(column++);
  columns.label = row->Text(column++);
  columns.existence = row->Double(column++);
  columns.classes = row->Text(column++);
  columns.tags = row->Text(column++);
  columns.attributes = row->Text(column++);
  columns.height_min = row->OptionalDouble(column++);
  columns.height_max = row->OptionalDouble(column++);
  columns.expires_at_ns = row->OptionalInt64(column++);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return DecodeObject(columns);
}

}  // namespace hypermap::storage::postgres
