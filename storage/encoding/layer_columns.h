// The columns of a layer in the tables of all stores.
#ifndef HYPERMAP_STORAGE_ENCODING_LAYER_COLUMNS_H_
#define HYPERMAP_STORAGE_ENCODING_LAYER_COLUMNS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/grid/grid_geometry.h"
#include "map/layers/layer_spec.h"

namespace hypermap::storage {

// The cells of a grid that may be known. All are NULL when the extent is empty.
struct ExtentColumns {
  std::optional<int64_t> row_begin;
  std::optional<int64_t> row_end;
  std::optional<int64_t> col_begin;
  std::optional<int64_t> col_end;
};

struct LayerColumns {
  std::string name;
  std::string kind;
  std::string frame_id;
  // NULL unless the layer is a grid.
  std::optional<double> origin_x;
  std::optional<double> origin_y;
  std::optional<double> origin_yaw;
  std::optional<double> resolution_m;
  ExtentColumns extent;
  std::string parameters;  // EncodeLayerParameters
};

ExtentColumns EncodeExtent(const CellBox& extent);

// INVALID_ARGUMENT for text that is not UTF-8.
absl::StatusOr<LayerColumns> EncodeLayer(const LayerSpec& spec, const CellBox& extent);

struct DecodedLayer {
  LayerSpec spec;
  CellBox extent;  // of a grid; empty when it was never written to
};
// DATA_LOSS; INVALID_ARGUMENT for a layer that no store would have been given.
absl::StatusOr<DecodedLayer> DecodeLayer(const LayerColumns& columns);

// The fields of a spec that only some kinds of layer have, as a JSON object: a new kind needs no
// new columns. Decoding gives an absent field its default. INVALID_ARGUMENT for text that is not
// UTF-8; DATA_LOSS.
absl::StatusOr<std::string> EncodeLayerParameters(const LayerSpec& spec);
absl::Status DecodeLayerParameters(absl::string_view text, LayerSpec* spec);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_LAYER_COLUMNS_H_
