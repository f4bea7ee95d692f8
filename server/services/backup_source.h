// The messages of the BackupMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_BACKUP_SOURCE_H_
#define HYPERMAP_SERVER_SERVICES_BACKUP_SOURCE_H_

#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/streamed_answer.h"

namespace hypermap::server {

// Copies the stored map to a scratch file and waits for it. The messages contain the copy in pieces
// of at most limits.max_chunk_bytes. `client` is charged for the bytes on disk; RESOURCE_EXHAUSTED,
// naming --max_scratch_bytes, if there are too many. The source removes the file when it is
// destroyed.
absl::StatusOr<std::unique_ptr<MessageSource<v1::BackupMapResponse>>> OpenBackup(
    const Facilities& facilities, absl::string_view client, const v1::BackupMapRequest& request);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_BACKUP_SOURCE_H_
