#include "server/services/backup_source.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "base/admission/budget.h"
#include "base/status/status_macros.h"
#include "server/rpc/scratch_file.h"

namespace hypermap::server {
namespace {

class BackupSource : public MessageSource<v1::BackupMapResponse> {
 public:
  BackupSource(const Facilities& facilities, absl::string_view client)
      : file_(facilities.scratch_dir),
        charge_(&facilities.budgets->scratch_bytes, client),
        max_chunk_bytes_(facilities.limits.max_chunk_bytes) {}

  absl::Status Open(MapSession& session) {
    HYPERMAP_RETURN_IF_ERROR(session.BackupTo(
        file_.path(), [this](int64_t most_bytes) { return charge_.Add(most_bytes); }));
    std::error_code error;
    const auto size = static_cast<int64_t>(std::filesystem::file_size(file_.path(), error));
    if (error) return CannotRead();
    if (size < charge_.amount()) charge_.GiveBack(charge_.amount() - size);
    // Edits have made the map larger since the room was reserved.
    if (size > charge_.amount()) {
      HYPERMAP_RETURN_IF_ERROR(charge_.Add(size - charge_.amount()));
    }
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
  admission::Budget::Charge charge_;
  std::ifstream stream_;
  const int64_t max_chunk_bytes_;
  int64_t bytes_ = 0;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MessageSource<v1::BackupMapResponse>>> OpenBackup(
    const Facilities& facilities, absl::string_view client, const v1::BackupMapRequest& request) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<MapSession> session,
                            FindMap(facilities, request.map()));
  auto source = std::make_unique<BackupSource>(facilities, client);
  HYPERMAP_RETURN_IF_ERROR(source->Open(*session));
  return source;
}

}  // namespace hypermap::server
