#include "server/rpc/scratch_file.h"

#include <filesystem>
#include <ios>
#include <system_error>

#include "absl/random/random.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/give_way.h"

namespace hypermap::server {
namespace {

constexpr char kPrefix[] = ".scratch-";
// The kernel takes a piece in some 50 us. One of 4 MB, which it takes in milliseconds, would hold
// up threads that wait for a processor.
constexpr size_t kWriteBytes = 64 << 10;

std::string NewPath(const std::string& folder) {
  absl::BitGen random;
  return absl::StrCat(folder, "/", kPrefix,
                      absl::Hex(absl::Uniform<uint64_t>(random), absl::kZeroPad16));
}

}  // namespace

ScratchFile::ScratchFile(const std::string& folder) : path_(NewPath(folder)) {}

ScratchFile::~ScratchFile() {
  Close();
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

bool ScratchFile::Append(absl::string_view bytes) {
  if (!appended_.is_open()) appended_.open(path_, std::ios::binary | std::ios::app);
  while (!bytes.empty() && appended_) {
    const absl::string_view piece = bytes.substr(0, kWriteBytes);
    appended_.write(piece.data(), static_cast<std::streamsize>(piece.size())).flush();
    bytes.remove_prefix(piece.size());
    GiveWay();
  }
  return appended_.good();
}

void ScratchFile::RemoveLeftOver(const std::string& folder) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (!absl::StartsWith(entry.path().filename().string(), kPrefix)) continue;
    // Stores may have made folders beside files.
    std::filesystem::remove_all(entry.path(), ignored);
  }
}

}  // namespace hypermap::server
