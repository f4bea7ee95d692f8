#include "server/services/export_source.h"

#include <string>
#include <utility>

#include "base/admission/budget.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "server/services/map_files.h"

namespace hypermap::server {
namespace {

class ExportSource : public MessageSource<v1::ExportMapResponse> {
 public:
  ExportSource(const Facilities& facilities, absl::string_view client)
      : charge_(&facilities.budgets->request_bytes, client),
        max_chunk_bytes_(static_cast<size_t>(facilities.limits.max_chunk_bytes)) {}

  // The size is known only when the files are there. As many are encoded at a time as there are
  // file workers.
  absl::Status Open(v1::ExportHeader header, storage::ExportedFiles exported) {
    int64_t bytes = 0;
    for (const storage::NamedFile& file : exported.files) {
      bytes += static_cast<int64_t>(file.data.size());
    }
    HYPERMAP_RETURN_IF_ERROR(charge_.Add(bytes));
    header_ = std::move(header);
    exported_ = std::move(exported);
    return absl::OkStatus();
  }

  absl::StatusOr<Step> Next(v1::ExportMapResponse* message) override {
    if (!header_taken_) {
      header_taken_ = true;
      message->mutable_header()->Swap(&header_);
      return Step::kMessage;
    }
    if (file_ == exported_.files.size()) return Step::kEnd;
    TakePiece(message->mutable_chunk());
    return Step::kMessage;
  }

  int64_t items() const override { return static_cast<int64_t>(file_); }

 private:
  // Takes the next piece, and frees each file after its last one.
  void TakePiece(v1::FileChunk* chunk) {
    storage::NamedFile& file = exported_.files[file_];
    chunk->set_file_name(file.name);
    chunk->set_data(file.data.substr(offset_, max_chunk_bytes_));
    offset_ += chunk->data().size();
    if (offset_ < file.data.size()) return;
    file.data = std::string();
    offset_ = 0;
    ++file_;
  }

  admission::Budget::Charge charge_;
  v1::ExportHeader header_;
  bool header_taken_ = false;
  storage::ExportedFiles exported_;
  const size_t max_chunk_bytes_;
  size_t file_ = 0;    // index of the file that is being sent
  size_t offset_ = 0;  // of the next piece in it
};

}  // namespace

absl::StatusOr<std::unique_ptr<MessageSource<v1::ExportMapResponse>>> OpenExport(
    const Facilities& facilities, absl::string_view client, const v1::ExportMapRequest& request) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities, request.map()));
  const SnapshotPtr snapshot = session->snapshot();
  MemoryCap memory("max_request_bytes", facilities.limits.max_request_bytes);
  MemoryMeter meter(&memory);
  const ScopedMeter metered(&meter);
  HYPERMAP_ASSIGN_OR_RETURN(storage::ExportedFiles exported, EncodeFiles(request, *snapshot));
  v1::ExportHeader header;
  header.set_map(request.map());
  header.set_revision(snapshot->revision);
  header.set_incarnation(session->incarnation());
  header.mutable_omissions()->Assign(exported.omissions.begin(), exported.omissions.end());
  auto source = std::make_unique<ExportSource>(facilities, client);
  HYPERMAP_RETURN_IF_ERROR(source->Open(std::move(header), std::move(exported)));
  return source;
}

}  // namespace hypermap::server
