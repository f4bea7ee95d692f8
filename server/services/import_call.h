// One ImportMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
#define HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/request_digest.h"
#include "server/services/upload_call.h"
#include "server/services/uploaded_files.h"
#include "server/session/map_session.h"
#include "storage/interchange/imported_map.h"

namespace hypermap::server {

// Collects the files of an import, decodes them on a worker, and submits the edits as one batch. If
// a new map can't be filled, it is removed again.
class ImportCall final : public UploadCall<v1::ImportMapRequest, v1::ImportMapResponse> {
 public:
  // `facilities` must outlive this; context and response live until OnDone.
  ImportCall(grpc::CallbackServerContext* context, const Facilities* facilities,
             grpc::ByteBuffer* response);

 private:
  absl::Status Take(v1::ImportMapRequest message) override;
  // Decodes and submits the files.
  absl::Status CarryOut() override;
  const v1::ImportMapResponse& response() const override { return response_; }
  int64_t items() const override { return response_.layers_size(); }
  void RemoveFiles() override;

  absl::StatusOr<storage::ImportedMap> Decode(const Snapshot* snapshot);
  absl::StatusOr<storage::Receipt> ImportInto(MapSession& session);
  absl::StatusOr<storage::Receipt> ImportIntoNewMap();
  absl::StatusOr<storage::Receipt> Submit(MapSession& session, storage::ImportedMap imported);

  v1::ImportMapResponse response_;
  std::optional<v1::ImportHeader> header_;
  std::string author_;
  // Digest of the header and the files so far. None if the request has no id.
  std::optional<RequestDigest> digest_;
  UploadedFiles files_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_IMPORT_CALL_H_
