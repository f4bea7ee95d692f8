// The columns of a change in the logs of all stores. Changes of objects and tiles name them only;
// their content before and after is in their history. Changes of structure are stored whole, in
// `detail`.
#ifndef HYPERMAP_STORAGE_ENCODING_CHANGE_COLUMNS_H_
#define HYPERMAP_STORAGE_ENCODING_CHANGE_COLUMNS_H_

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/edits/change.h"
#include "map/grid/tile.h"
#include "map/layers/layer_spec.h"
#include "map/objects/semantic_object.h"

namespace hypermap::storage {

inline constexpr char kObjectPut[] = "put";
inline constexpr char kObjectRemoved[] = "remove";
inline constexpr char kTileWritten[] = "tile";

// Those that are not set are NULL.
struct ChangeColumns {
  const char* kind = nullptr;
  std::optional<ObjectId> object_id;
  std::optional<TileIndex> tile;
  std::optional<std::string> detail;  // JSON
};

// INVALID_ARGUMENT for text that is not UTF-8.
absl::StatusOr<ChangeColumns> EncodeChange(const Change& change);

// Decodes a change of structure, which is every change except those of objects and tiles. `layer`
// is the layer of its lineage; for a change of no layer it is not used. DATA_LOSS.
absl::StatusOr<Change> DecodeStructureChange(absl::string_view kind, absl::string_view detail,
                                             const LayerSpec& layer);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_ENCODING_CHANGE_COLUMNS_H_
