#include "storage/geopackage/object_row.h"

#include "base/status/status_macros.h"
#include "storage/encoding/object_columns.h"

namespace hypermap::storage {

absl::StatusOr<ObjectPtr> ReadObjectRow(Statement* row) {
  ObjectColumns columns;
  columns.id = row->Int64(kObjectIdColumn);
  columns.shape = row->Blob(1);
  columns.label = row->Text(2);
  columns.existence = row->Double(3);
  columns.classes = row->Text(4);
  columns.tags = row->Text(5);
  columns.attributes = row->Text(6);
  columns.height_min = row->OptionalDouble(7);
  columns.height_max = row->OptionalDouble(8);
  columns.expires_at_ns = row->OptionalInt64(9);
  columns.version = row->Int64(kObjectVersionColumn);
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  return DecodeObject(columns);
}

}  // namespace hypermap::storage
