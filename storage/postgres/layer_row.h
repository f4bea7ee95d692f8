// The columns of a layer in hypermap.lineages and hypermap.layer_versions.
#ifndef HYPERMAP_STORAGE_POSTGRES_LAYER_ROW_H_
#define HYPERMAP_STORAGE_POSTGRES_LAYER_ROW_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "map/layers/layer_spec.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// A layer as one of its versions has it.
struct StoredLayer {
  LayerSpec spec;
  CellBox extent;  // of a grid; empty when it was never written to
  int64_t lineage = 0;
};

// The columns that ReadLayerRow expects, in this order, of a row l of hypermap.lineages and a row v
// of hypermap.layer_versions. They are written with EncodeLayer (storage/encoding/layer_columns.h).
inline constexpr char kLayerColumns[] =
    "l.lineage, l.name, l.kind, l.frame_id, l.origin_x, l.origin_y, l.origin_yaw, l.resolution_m, "
    "v.row_begin, v.row_end, v.col_begin, v.col_end, v.parameters";
inline constexpr int kNumLayerColumns = 13;

// Reads a layer from the columns that begin with `first_column`. DATA_LOSS; INVALID_ARGUMENT for a
// layer that no store would have been given.
absl::StatusOr<StoredLayer> ReadLayerRow(Rows* row, int first_column = 0);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_LAYER_ROW_H_
