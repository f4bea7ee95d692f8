// Interchange files in the words of the requests that carry them.
#ifndef HYPERMAP_SERVER_SERVICES_MAP_FILES_H_
#define HYPERMAP_SERVER_SERVICES_MAP_FILES_H_

#include <vector>

#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "map/snapshot.h"
#include "server/rpc/facilities.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// The files of an import as edits of `snapshot`, null for a new map. INVALID_ARGUMENT for a format
// that is not known, else as the format's decoder.
absl::StatusOr<storage::ImportedMap> DecodeFiles(const v1::ImportHeader& header,
                                                 const std::vector<storage::NamedFile>& files,
                                                 const Snapshot* snapshot,
                                                 const ServiceLimits& limits);

// The layers of an export as files. NOT_FOUND for a layer, else as the format's encoder.
absl::StatusOr<storage::ExportedFiles> EncodeFiles(const v1::ExportMapRequest& request,
                                                   const Snapshot& snapshot);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_MAP_FILES_H_
