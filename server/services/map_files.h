// Decodes and encodes interchange files as ImportMap and ExportMap ask for them.
#ifndef HYPERMAP_SERVER_SERVICES_MAP_FILES_H_
#define HYPERMAP_SERVER_SERVICES_MAP_FILES_H_

#include <vector>

#include "absl/status/statusor.h"
#include "base/limits/limits.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "map/snapshot.h"
#include "server/rpc/facilities.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// Decodes the files of an import to edits of `snapshot`; null for a new map. INVALID_ARGUMENT for
// an unknown format; other errors are those of the format's decoder.
absl::StatusOr<storage::ImportedMap> DecodeFiles(const v1::ImportHeader& header,
                                                 const std::vector<storage::NamedFile>& files,
                                                 const Snapshot* snapshot, const Limits& limits);

// Encodes the requested layers as files. NOT_FOUND for a layer; INVALID_ARGUMENT for an unknown
// format; other errors are those of the format's encoder.
absl::StatusOr<storage::ExportedFiles> EncodeFiles(const v1::ExportMapRequest& request,
                                                   const Snapshot& snapshot);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_MAP_FILES_H_
