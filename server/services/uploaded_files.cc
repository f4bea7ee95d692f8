#include "server/services/uploaded_files.h"

#include <algorithm>
#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"

namespace hypermap::server {
namespace {

// As file systems allow.
constexpr size_t kMaxNameBytes = 255;

absl::Status ValidateFileName(const std::string& name) {
  if (name.empty()) return absl::InvalidArgumentError("chunk.file_name is empty");
  if (name.size() > kMaxNameBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("chunk.file_name has more than ", kMaxNameBytes, " bytes"));
  }
  if (name.find_first_of("/\\") == std::string::npos) return absl::OkStatus();
  return absl::InvalidArgumentError("chunk.file_name must not have folders");
}

}  // namespace

UploadedFiles::UploadedFiles(const Facilities& facilities, absl::string_view client)
    : facilities_(facilities), charge_(&facilities.budgets->scratch_bytes, client) {}

absl::Status UploadedFiles::Append(const std::string& file_name, const std::string& piece) {
  const auto size = static_cast<int64_t>(piece.size());
  if (charge_.amount() + size > facilities_.limits.max_import_bytes) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "the files are larger than --max_import_bytes, ", facilities_.limits.max_import_bytes));
  }
  if (files_.empty() || files_.back().name != file_name) {
    HYPERMAP_RETURN_IF_ERROR(Open(file_name));
  }
  HYPERMAP_RETURN_IF_ERROR(charge_.Add(size));
  files_.back().size += size;
  if (files_.back().scratch->Append(piece)) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("chunk of ", file_name, " can't be kept: is the server's disk full?"));
}

absl::Status UploadedFiles::Open(const std::string& file_name) {
  HYPERMAP_RETURN_IF_ERROR(ValidateFileName(file_name));
  if (files_.size() == FixedLimits::kMaxImportFiles) {
    return absl::ResourceExhaustedError(
        absl::StrCat("more than ", FixedLimits::kMaxImportFiles, " files"));
  }
  if (std::any_of(files_.begin(), files_.end(),
                  [&](const File& file) { return file.name == file_name; })) {
    return absl::InvalidArgumentError(
        absl::StrCat("the pieces of ", file_name, " must follow each other"));
  }
  if (!files_.empty()) files_.back().scratch->Close();
  files_.push_back({file_name, std::make_unique<ScratchFile>(facilities_.scratch_dir)});
  return absl::OkStatus();
}

void UploadedFiles::Remove() {
  files_.clear();
  charge_.GiveBack();
}

absl::StatusOr<std::vector<storage::NamedFile>> UploadedFiles::Read() {
  if (!files_.empty()) files_.back().scratch->Close();
  std::vector<storage::NamedFile> read;
  for (const File& file : files_) {
    std::string data(file.size, '\0');
    std::ifstream stream(file.scratch->path(), std::ios::binary);
    if (!stream.read(data.data(), file.size)) {
      return absl::UnavailableError(absl::StrCat(file.name, " can't be read back"));
    }
    read.push_back({file.name, std::move(data)});
  }
  return read;
}

}  // namespace hypermap::server
