// The file format of the original Hypermap: a zip archive of hmap_config.yaml, occupancy YAML with
// PNG, and semantic YAML (docs/hmap_format.md).
#ifndef HYPERMAP_STORAGE_INTERCHANGE_HMAP_H_
#define HYPERMAP_STORAGE_INTERCHANGE_HMAP_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/limits/limits.h"
#include "map/snapshot.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::storage {

// INVALID_ARGUMENT naming the member and the place when something can't be understood;
// RESOURCE_EXHAUSTED naming the limit.
absl::StatusOr<ImportedMap> DecodeHmap(absl::string_view data, const Limits& limits);

// Encodes the occupancy and semantic layers as one file, `<map_name>.hmap`. Layers of other kinds,
// and objects with line strings and points, which the original can't read, are omissions. Errors of
// TakeMemory and CheckCancelled.
absl::StatusOr<ExportedFiles> EncodeHmap(const Snapshot& snapshot);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_HMAP_H_
