#include "server/services/restore_call.h"

#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/check_report.h"
#include "server/rpc/map_message.h"
#include "server/session/map_session.h"

namespace hypermap::server {

RestoreCall::RestoreCall(grpc::CallbackServerContext* context, const Facilities* facilities,
                         grpc::ByteBuffer* response)
    : UploadCall(context, facilities, response, Rpc::kRestoreMap),
      charge_(&facilities->budgets->scratch_bytes, context_.ticket().client()) {
  Begin();
}

absl::Status RestoreCall::Take(v1::RestoreMapRequest message) {
  if (message.has_header()) {
    if (header_) return absl::InvalidArgumentError("header may come once, in the first message");
    header_ = std::move(*message.mutable_header());
    HYPERMAP_RETURN_IF_ERROR(context_.EnterMap(header_->map()));
    HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(header_->request_id()));
    file_.emplace(facilities_->scratch_dir);
    return Append("");  // makes the file, if no data come
  }
  if (!header_) return absl::InvalidArgumentError("the first message must carry the header");
  return Append(message.data());
}

absl::Status RestoreCall::Append(absl::string_view data) {
  HYPERMAP_RETURN_IF_ERROR(charge_.Add(static_cast<int64_t>(data.size())));
  if (file_->Append(data)) return absl::OkStatus();
  return absl::ResourceExhaustedError("the file can't be kept: is the server's disk full?");
}

absl::Status RestoreCall::CarryOut() {
  // A cancelled stream ends like a complete one, but the file is not complete.
  Cancellation cancellation([this] { return context_.CheckWanted(); });
  const ScopedCancellation here(&cancellation);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!header_) return absl::InvalidArgumentError("the first message must carry the header");
  file_->Close();
  HYPERMAP_RETURN_IF_ERROR(CheckFile());
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::shared_ptr<MapSession> session,
      facilities_->site->Restore({header_->map(), file_->path(), header_->replace(),
                                  header_->request_id(), header_->incarnation()}));
  EncodeMap(*session, response_.mutable_map());
  context_.Edited(response_.map().revision(), header_->request_id(), /*edits=*/0);
  return absl::OkStatus();
}

absl::Status RestoreCall::CheckFile() {
  HYPERMAP_ASSIGN_OR_RETURN(const CheckReport report, facilities_->site->CheckFile(file_->path()));
  if (report.is_clean()) return absl::OkStatus();
  const int64_t others = static_cast<int64_t>(report.findings.size()) - 1 + report.more;
  return absl::DataLossError(
      absl::StrCat("the file is damaged, and is not restored: ", Describe(report.findings.front()),
                   "; and ", others, " other findings"));
}

void RestoreCall::RemoveFiles() {
  file_.reset();
  charge_.GiveBack();
}

}  // namespace hypermap::server
