// The messages of the ExportMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_EXPORT_SOURCE_H_
#define HYPERMAP_SERVER_SERVICES_EXPORT_SOURCE_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"

namespace hypermap::server {

// Encodes the map's newest revision as files, in memory. The messages contain a header, then the
// files in pieces of at most limits.max_chunk_bytes. `client` is charged for the bytes of the files
// until all are sent; RESOURCE_EXHAUSTED, naming --max_request_bytes, if there are too many.
absl::StatusOr<std::unique_ptr<MessageSource<v1::ExportMapResponse>>> OpenExport(
    const Facilities& facilities, absl::string_view client, const v1::ExportMapRequest& request);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_EXPORT_SOURCE_H_
