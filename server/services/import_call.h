// The ImportMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
#define HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_log.h"
#include "server/session/map_session.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// Gathers the files of an import, then decodes them on a worker and hands the edits to the map's
// writer as one batch. A new map that can't be filled is removed again. Owns itself until OnDone.
class ImportCall final : public grpc::ServerReadReactor<v1::ImportMapRequest> {
 public:
  // All outlive this; the context and the response live until OnDone.
  ImportCall(const grpc::CallbackServerContext* context, const Facilities* facilities,
             v1::ImportMapResponse* response);

  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  absl::Status TakeMessage();
  absl::Status TakeChunk(v1::FileChunk* chunk);

  // Everything after the last message; waits for the disk.
  absl::Status Import();
  absl::StatusOr<storage::ImportedMap> Decode(const Snapshot* snapshot) const;
  absl::StatusOr<storage::Receipt> ImportInto(MapSession& session);
  absl::StatusOr<storage::Receipt> ImportIntoNewMap();
  absl::StatusOr<storage::Receipt> Submit(MapSession& session, storage::ImportedMap imported);

  void End(const absl::Status& status);

  const grpc::CallbackServerContext* const context_;
  const Facilities* const facilities_;
  v1::ImportMapResponse* const response_;
  RequestLog log_;
  v1::ImportMapRequest message_;
  std::optional<v1::ImportHeader> header_;
  std::vector<storage::NamedFile> files_;
  int64_t bytes_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
