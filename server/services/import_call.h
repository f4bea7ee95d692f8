// One ImportMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
#define HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/call_context.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_digest.h"
#include "server/services/uploaded_files.h"
#include "server/session/map_session.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// Collects the files of an import, decodes them on a worker, and submits the edits as one batch. If
// a new map can't be filled, it is removed again. A worker takes each message, too, because that
// writes to the disk; the next one is read when it has. So a call has one owner at any time: gRPC
// during a read, until OnReadDone gives the call to a worker, which reads again or ends it. Deletes
// itself in OnDone, which gRPC calls after Finish.
class ImportCall final : public grpc::ServerReadReactor<grpc::ByteBuffer> {
 public:
  // `facilities` must outlive this; context and response live until OnDone.
  ImportCall(grpc::CallbackServerContext* context, const Facilities* facilities,
             grpc::ByteBuffer* response);

  void OnReadDone(bool ok) override;
  void OnDone() override;

 private:
  // Charges for the arrival of the message that was read.
  absl::Status ChargeMessage();
  // Takes the message on a worker, and charges for the rest of it meanwhile.
  absl::Status TakeMessage();
  absl::Status Take(v1::ImportMapRequest message);

  // Decodes and submits the files, when all have arrived. Waits for the disk.
  absl::Status Import();
  absl::StatusOr<storage::ImportedMap> Decode(const Snapshot* snapshot);
  absl::StatusOr<storage::Receipt> ImportInto(MapSession& session);
  absl::StatusOr<storage::Receipt> ImportIntoNewMap();
  absl::StatusOr<storage::Receipt> Submit(MapSession& session, storage::ImportedMap imported);

  void ReadNext();
  // Removes the files, so that OnDone need not, and ends the call.
  void End(const absl::Status& status);

  const Facilities* const facilities_;
  grpc::ByteBuffer* const encoded_response_;
  v1::ImportMapResponse response_;
  CallContext context_;
  CallTicket& ticket_;     // of context_
  grpc::ByteBuffer read_;  // target of the read under way, or the message that waits for a worker
  int64_t message_cost_ = 0;  // charged for the message
  std::optional<v1::ImportHeader> header_;
  std::string author_;
  // Digest of the header and the files so far. None if the request has no id.
  std::optional<RequestDigest> digest_;
  UploadedFiles files_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
