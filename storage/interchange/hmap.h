// The original Hypermap's file: a zip of hmap_config.yaml, occupancy YAML + PNG, and semantic YAML
// (format: docs/hmap_format.md).
#ifndef HYPERMAP_STORAGE_INTERCHANGE_HMAP_H_
#define HYPERMAP_STORAGE_INTERCHANGE_HMAP_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "map/snapshot.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::storage {

// INVALID_ARGUMENT naming the member and the place for what can't be understood.
absl::StatusOr<ImportedMap> DecodeHmap(absl::string_view data, const ImportLimits& limits);

// One file `<map_name>.hmap`. Occupancy and semantic layers are written; other kinds are omissions.
absl::StatusOr<ExportedFiles> EncodeHmap(const Snapshot& snapshot);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_HMAP_H_
