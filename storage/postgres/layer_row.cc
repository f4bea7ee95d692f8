#include "storage/postgres/layer_row.h"

#include <string>
#include <utility>

#include "base/status/status_macros.h"
#include "storage/encoding/layer_columns.h"

namespace hypermap::storage::postgres {

absl::StatusOr<StoredLayer> ReadLayerRow(Rows* row, int first_column) {
  int column = first_column;
  LayerColumns columns;
  const int64_t lineage = row->Int64(column++);
  columns.name = std::string(row->Text(column++));
  columns.kind = std::string(row->Text(column++));
  columns.frame_id = std::string(row->Text(column++));
  columns.origin_x = row->OptionalDouble(column++);
  columns.origin_y = row->OptionalDouble(column++);
  columns.origin_yaw = row->OptionalDouble(column++);
  columns.resolution_m = row->OptionalDouble(column++);
  columns.extent.row_begin = row->OptionalInt64(column++);
  columns.extent.row_end = row->OptionalInt64(column++);
  columns.extent.col_begin = row->OptionalInt64(column++);
  columns.extent.col_end = row->OptionalInt64(column++);
  columns.parameters = std::string(row->Text(column++));
  HYPERMAP_RETURN_IF_ERROR(row->row_status());
  HYPERMAP_ASSIGN_OR_RETURN(DecodedLayer layer, DecodeLayer(columns));
  return StoredLayer{std::move(layer.spec), layer.extent, lineage};
}

}  // namespace hypermap::storage::postgres
