#include "server/services/import_call.h"

#include <cstdint>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/admission/memory.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "server/services/map_files.h"

namespace hypermap::server {
namespace {

// Estimate of the bytes of memory that each byte of a file takes while it is decoded.
constexpr int64_t kBytesPerFileByte = 3;
// The header is in memory twice: in the call and in its log line.
constexpr int64_t kCopiesOfHeader = 2;
// After the import of larger files, freed memory is returned to the system.
constexpr int64_t kLargeImportBytes = 8 << 20;

}  // namespace

ImportCall::ImportCall(grpc::CallbackServerContext* context, const Facilities* facilities,
                       grpc::ByteBuffer* response)
    : UploadCall(context, facilities, response, Rpc::kImportMap),
      files_(*facilities, context_.ticket().client()) {
  Begin();
}

void ImportCall::RemoveFiles() {
  if (files_.bytes() >= kLargeImportBytes) admission::ReturnFreedMemory();
  files_.Remove();
}

absl::Status ImportCall::Take(v1::ImportMapRequest message) {
  if (message.has_header()) {
    if (header_) return absl::InvalidArgumentError("header may come once, in the first message");
    // Kept until the call ends.
    const auto bytes = static_cast<int64_t>(message.header().SpaceUsedLong());
    if (bytes > CallTicket::kFreeBytes) {
      HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeMemory(kCopiesOfHeader * bytes));
    }
    header_ = std::move(*message.mutable_header());
    if (!header_->request_id().empty()) digest_.emplace(*header_);
    return context_.EnterMap(header_->map());
  }
  if (!header_) return absl::InvalidArgumentError("the first message must carry the header");
  if (!message.has_chunk()) return absl::InvalidArgumentError("a message carries nothing");
  const v1::FileChunk& chunk = message.chunk();
  HYPERMAP_RETURN_IF_ERROR(files_.Append(chunk.file_name(), chunk.data()));
  if (digest_) digest_->AddPiece(chunk.file_name(), chunk.data());
  return absl::OkStatus();
}

absl::Status ImportCall::CarryOut() {
  // A cancelled stream ends like a complete one, but the files are not complete.
  Cancellation cancellation([this] { return context_.CheckWanted(); });
  const ScopedCancellation here(&cancellation);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  if (!header_) return absl::InvalidArgumentError("the first message must carry the header");
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(header_->request_id()));
  HYPERMAP_ASSIGN_OR_RETURN(author_, context_.author());
  const absl::StatusOr<std::shared_ptr<MapSession>> session =
      FindMap(*facilities_, header_->map(), header_->incarnation());
  const bool make_map = absl::IsNotFound(session.status()) && header_->create_map();
  if (make_map && header_->incarnation() != 0) {
    return absl::AbortedError(absl::StrCat("there is no map \"", header_->map(),
                                           "\", but the request expects its incarnation ",
                                           header_->incarnation()));
  }
  if (!session.ok() && !make_map) return session.status();
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                            make_map ? ImportIntoNewMap() : ImportInto(**session));
  response_.set_map(header_->map());
  response_.set_revision(receipt.revision);
  context_.Edited(receipt.revision, header_->request_id(),
                  static_cast<int64_t>(receipt.object_ids.size()));
  return absl::OkStatus();
}

absl::StatusOr<storage::ImportedMap> ImportCall::Decode(const Snapshot* snapshot) {
  MemoryCap memory("max_request_bytes", facilities_->limits.max_request_bytes);
  MemoryMeter meter(&memory);
  const ScopedMeter metered(&meter);
  HYPERMAP_RETURN_IF_ERROR(ticket_.ChargeMemory(files_.bytes() * kBytesPerFileByte));
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<storage::NamedFile> files, files_.Read());
  absl::StatusOr<storage::ImportedMap> imported =
      DecodeFiles(*header_, files, snapshot, facilities_->limits);
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  return imported;
}

absl::StatusOr<storage::Receipt> ImportCall::ImportInto(MapSession& session) {
  const SnapshotPtr snapshot = session.snapshot();
  HYPERMAP_ASSIGN_OR_RETURN(storage::ImportedMap imported, Decode(snapshot.get()));
  return Submit(session, std::move(imported));
}

absl::StatusOr<storage::Receipt> ImportCall::ImportIntoNewMap() {
  HYPERMAP_ASSIGN_OR_RETURN(storage::ImportedMap imported, Decode(nullptr));
  const Site::NewMap map{header_->map(), imported.frame_id, header_->request_id()};
  absl::StatusOr<storage::Receipt> receipt = absl::UnknownError("not filled");
  bool filled = false;
  const absl::StatusOr<std::shared_ptr<MapSession>> session =
      facilities_->site->CreateFilled(map, [&](MapSession& made) {
        filled = true;
        receipt = Submit(made, std::move(imported));
        return receipt.status();
      });
  if (!session.ok()) return session.status();
  // If `fill` was not called, a concurrent retry of this request has created the map. Its receipt
  // answers this call, too.
  return filled ? receipt : ImportInto(**session);
}

absl::StatusOr<storage::Receipt> ImportCall::Submit(MapSession& session,
                                                    storage::ImportedMap imported) {
  response_.mutable_layers()->Assign(imported.layers.begin(), imported.layers.end());
  response_.mutable_repairs()->Assign(imported.repairs.begin(), imported.repairs.end());
  response_.set_incarnation(session.incarnation());
  std::string digest = digest_ ? std::move(*digest_).Finish() : "";
  Submission submission{std::move(imported.batch), author_, header_->request_id(),
                        std::move(digest)};
  submission.client = ticket_.client();
  return session.SubmitAndWait(std::move(submission));
}

}  // namespace hypermap::server
