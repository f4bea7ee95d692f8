// hypermap_layers: the spec of each layer, the table of its content, and the extent of a grid.
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
  CellBox extent;  // of a grid; empty when it was never written to
  int64_t lineage = 0;
};

absl::Status InsertLayer(Database* database, const StoredLayer& layer);
absl::Status UpdateLayerExtent(Database* database, const std::string& layer, const CellBox& extent);
// Writes the part of the spec that may change: the aliases.
absl::Status UpdateLayerParameters(Database* database, const LayerSpec& spec);
absl::Status RemoveLayer(Database* database, const std::string& layer);

// Reads all layers, ordered by name. DATA_LOSS naming the layer whose row is not valid.
absl::StatusOr<std::vector<StoredLayer>> ReadLayers(Database* database);

inline constexpr char kLayerColumns[] =
    "name, kind, table_name, frame_id, origin_x, origin_y, origin_yaw, resolution_m, row_begin, "
    "row_end, col_begin, col_end, parameters, lineage";
// Reads a layer from a row of kLayerColumns. DATA_LOSS.
absl::StatusOr<StoredLayer> ReadLayerRow(Statement* row);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_LAYER_TABLE_H_
