#include "server/services/backup_source.h"

#include <fstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "server/rpc/scratch_file.h"

namespace hypermap::server {
namespace {

class BackupSource : public MessageSource<v1::BackupMapResponse> {
 public:
  explicit BackupSource(const Facilities& facilities)
      : file_(facilities.scratch_dir), max_chunk_bytes_(facilities.limits.max_chunk_bytes) {}

  absl::Status Open(MapSession& session) {
    HYPERMAP_RETURN_IF_ERROR(session.BackupTo(file_.path()));
    stream_.open(file_.path(), std::ios::binary);
    return stream_ ? absl::OkStatus() : CannotRead();
  }

  absl::StatusOr<Step> Next(v1::BackupMapResponse* message) override {
    std::string& data = *message->mutable_data();
    data.resize(max_chunk_bytes_);
    stream_.read(data.data(), max_chunk_bytes_);
    if (stream_.bad()) return CannotRead();
    data.resize(stream_.gcount());
    bytes_ += stream_.gcount();
    return data.empty() ? Step::kEnd : Step::kMessage;
  }

  int64_t items() const override { return bytes_; }

 private:
  static absl::Status CannotRead() {
    return absl::UnavailableError("the copy of the map cannot be read back");
  }

  ScratchFile file_;
  std::ifstream stream_;
  const int64_t max_chunk_bytes_;
  int64_t bytes_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MessageSource<v1::BackupMapResponse>>> OpenBackup(
    const Facilities& facilities, const v1::BackupMapRequest& request) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities, request.map()));
  auto source = std::make_unique<BackupSource>(facilities);
  HYPERMAP_RETURN_IF_ERROR(source->Open(*session));
  return source;
}

}  // namespace hypermap::server
