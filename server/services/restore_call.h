// One RestoreMap rpc.
#ifndef HYPERMAP_SERVER_SERVICES_RESTORE_CALL_H_
#define HYPERMAP_SERVER_SERVICES_RESTORE_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/admission/budget.h"
#include "hypermap/v1/catalog_service.pb.h"
#include "server/rpc/facilities.h"
#include "server/rpc/scratch_file.h"
#include "server/services/upload_call.h"

namespace hypermap::server {

// Writes a backup to a scratch file, which is in the file system of the maps, checks it, and makes
// it a map.
class RestoreCall final : public UploadCall<v1::RestoreMapRequest, v1::RestoreMapResponse> {
 public:
  // `facilities` must outlive this; context and response live until OnDone.
  RestoreCall(grpc::CallbackServerContext* context, const Facilities* facilities,
              grpc::ByteBuffer* response);

 private:
  absl::Status Take(v1::RestoreMapRequest message) override;
  absl::Status CarryOut() override;
  const v1::RestoreMapResponse& response() const override { return response_; }
  int64_t items() const override { return response_.map().layer_count(); }
  void RemoveFiles() override;

  // RESOURCE_EXHAUSTED beyond --max_scratch_bytes or if the disk is full.
  absl::Status Append(absl::string_view data);
  // FAILED_PRECONDITION if the file is not a map; DATA_LOSS with the first finding.
  absl::Status CheckFile();

  v1::RestoreMapResponse response_;
  std::optional<v1::RestoreHeader> header_;
  std::optional<ScratchFile> file_;
  admission::Budget::Charge charge_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_RESTORE_CALL_H_
