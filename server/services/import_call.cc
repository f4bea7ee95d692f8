#include "server/services/import_call.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "server/rpc/wanted.h"
#include "server/services/map_files.h"
#include "wire/status.h"

namespace hypermap::server {
namespace {

absl::Status ValidateFileName(const std::string& name) {
  if (name.empty()) return absl::InvalidArgumentError("chunk.file_name is empty");
  if (name.find_first_of("/\\") == std::string::npos) return absl::OkStatus();
  return absl::InvalidArgumentError("chunk.file_name must not have folders");
}

}  // namespace

ImportCall::ImportCall(const grpc::CallbackServerContext* context, const Facilities* facilities,
                       v1::ImportMapResponse* response)
    : context_(context),
      facilities_(facilities),
      response_(response),
      log_(*context, "ImportMap", "") {
  StartRead(&message_);
}

void ImportCall::OnReadDone(bool ok) {
  if (!ok) {
    facilities_->file_workers->Run([this] { End(Import()); });
    return;
  }
  if (absl::Status status = TakeMessage(); !status.ok()) return End(status);
  message_.Clear();
  StartRead(&message_);
}

absl::Status ImportCall::TakeMessage() {
  if (message_.has_header()) {
    if (header_) return absl::InvalidArgumentError("header may come once, in the first message");
    header_ = std::move(*message_.mutable_header());
    log_.set_map(header_->map());
    return absl::OkStatus();
  }
  if (!header_) return absl::InvalidArgumentError("the first message must carry the header");
  if (!message_.has_chunk()) return absl::InvalidArgumentError("a message carries nothing");
  return TakeChunk(message_.mutable_chunk());
}

absl::Status ImportCall::TakeChunk(v1::FileChunk* chunk) {
  bytes_ += static_cast<int64_t>(chunk->data().size());
  if (bytes_ > facilities_->limits.max_import_bytes) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "the files are larger than --max_import_bytes, ", facilities_->limits.max_import_bytes));
  }
  if (!files_.empty() && files_.back().name == chunk->file_name()) {
    files_.back().data.append(chunk->data());
    return absl::OkStatus();
  }
  HYPERMAP_RETURN_IF_ERROR(ValidateFileName(chunk->file_name()));
  if (files_.size() == FixedLimits::kMaxImportFiles) {
    return absl::ResourceExhaustedError(
        absl::StrCat("more than ", FixedLimits::kMaxImportFiles, " files"));
  }
  if (std::any_of(files_.begin(), files_.end(),
                  [&](const auto& file) { return file.name == chunk->file_name(); })) {
    return absl::InvalidArgumentError(
        absl::StrCat("the pieces of ", chunk->file_name(), " must follow each other"));
  }
  files_.push_back({std::move(*chunk->mutable_file_name()), std::move(*chunk->mutable_data())});
  return absl::OkStatus();
}

absl::Status ImportCall::Import() {
  // A cancelled stream ends like a complete one, but the files are not complete.
  HYPERMAP_RETURN_IF_ERROR(CheckWanted(*context_));
  if (!header_) return absl::InvalidArgumentError("the first message must carry the header");
  HYPERMAP_RETURN_IF_ERROR(ValidateRequestId(header_->request_id()));
  const absl::StatusOr<std::shared_ptr<MapSession>> session = FindMap(*facilities_, header_->map());
  const bool make_map = absl::IsNotFound(session.status()) && header_->create_map();
  if (!session.ok() && !make_map) return session.status();
  HYPERMAP_ASSIGN_OR_RETURN(const storage::Receipt receipt,
                            make_map ? ImportIntoNewMap() : ImportInto(**session));
  response_->set_map(header_->map());
  response_->set_revision(receipt.revision);
  log_.Edited(receipt.revision, header_->request_id(),
              static_cast<int64_t>(receipt.object_ids.size()));
  return absl::OkStatus();
}

absl::StatusOr<storage::ImportedMap> ImportCall::Decode(const Snapshot* snapshot) const {
  absl::StatusOr<storage::ImportedMap> imported =
      DecodeFiles(*header_, files_, snapshot, facilities_->limits);
  if (!imported.ok()) return imported;
  HYPERMAP_RETURN_IF_ERROR(CheckWanted(*context_));
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
      facilities_->site->Create(map, [&](MapSession& made) {
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
  response_->mutable_layers()->Assign(imported.layers.begin(), imported.layers.end());
  response_->mutable_repairs()->Assign(imported.repairs.begin(), imported.repairs.end());
  return session.SubmitAndWait({std::move(imported.batch), log_.author(), header_->request_id()});
}

void ImportCall::End(const absl::Status& status) {
  log_.Finished(status, response_->layers_size());
  Finish(wire::EncodeStatus(status));
}

}  // namespace hypermap::server
