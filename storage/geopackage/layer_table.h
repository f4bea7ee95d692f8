// hypermap_layers: what each layer is, where its content is kept, and the extent of a grid.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_LAYER_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_LAYER_TABLE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/layers/layer_spec.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

inline constexpr char kLayersTable[] = "hypermap_layers";

// A row of the table.
struct StoredLayer {
  LayerSpec spec;
  std::string table;
  CellBox extent;  // of a grid; empty when nothing was written yet
  int64_t lineage = 0;
};

absl::Status InsertLayer(Database* database, const StoredLayer& layer);
absl::Status UpdateLayerExtent(Database* database, const std::string& layer, const CellBox& extent);
// What of the spec may change: the aliases.
absl::Status UpdateLayerParameters(Database* database, const LayerSpec& spec);
absl::Status RemoveLayer(Database* database, const std::string& layer);

// All layers by name. DATA_LOSS naming the one that is no valid layer or has no table.
absl::StatusOr<std::vector<StoredLayer>> ReadLayers(Database* database);

// A layer from a row of name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw,
// resolution_m, row_begin, row_end, col_begin, col_end, parameters, lineage. DATA_LOSS.
absl::StatusOr<StoredLayer> ReadLayerRow(Statement* row);

// What only some kinds have, as a JSON object, so that a new kind needs no new columns.
absl::StatusOr<std::string> EncodeLayerParameters(const LayerSpec& spec);
absl::Status DecodeLayerParameters(absl::string_view text, LayerSpec* spec);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_LAYER_TABLE_H_
