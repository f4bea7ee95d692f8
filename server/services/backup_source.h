// The messages of the BackupMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_BACKUP_SOURCE_H_
#define HYPERMAP_SERVER_SERVICES_BACKUP_SOURCE_H_

#include <memory>

#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"

namespace hypermap::server {

// Makes a copy of the stored map beside the maps, which comes out in pieces of at most
// limits.max_chunk_bytes and is removed at the end. Waits for the copy.
absl::StatusOr<std::unique_ptr<MessageSource<v1::BackupMapResponse>>> OpenBackup(
    const Facilities& facilities, const v1::BackupMapRequest& request);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_BACKUP_SOURCE_H_
