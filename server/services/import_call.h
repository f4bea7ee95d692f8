// One ImportMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
#define HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_digest.h"
#include "server/rpc/request_log.h"
#include "server/services/uploaded_files.h"
#include "server/session/map_session.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// Collects the files of an import, decodes them on a worker, and submits the edits as one
// batch. If a new map can't be filled, it is removed again. Deletes itself in OnDone.
class ImportCall final : public grpc::ServerReadReactor<v1::ImportMapRequest> {
 public:
  // `facilities` must outlive this; context and response live until OnDone.
  ImportCall(grpc::CallbackServerContext* context, const Facilities* facilities,
             v1::ImportMapResponse* response);

  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  absl::Status TakeMessage();

  // Decodes and submits the files, when all have arrived. Waits for the disk.
  absl::Status Import();
  absl::StatusOr<storage::ImportedMap> Decode(const Snapshot* snapshot);
  absl::StatusOr<storage::Receipt> ImportInto(MapSession& session);
  absl::StatusOr<storage::Receipt> ImportIntoNewMap();
  absl::StatusOr<storage::Receipt> Submit(MapSession& session, storage::ImportedMap imported);

  void End(const absl::Status& status);

  const grpc::CallbackServerContext* const context_;
  const Facilities* const facilities_;
  v1::ImportMapResponse* const response_;
  CallTicket ticket_;
  RequestLog log_;
  v1::ImportMapRequest message_;
  std::optional<v1::ImportHeader> header_;
  std::string author_;
  // Of the header and the files so far. None if the request has no id.
  std::optional<RequestDigest> digest_;
  UploadedFiles files_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
