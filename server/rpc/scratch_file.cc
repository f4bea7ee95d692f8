#include "server/rpc/scratch_file.h"

#include <filesystem>
#include <system_error>

#include "absl/random/random.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace hypermap::server {
namespace {

constexpr char kPrefix[] = ".scratch-";

std::string NewPath(const std::string& folder) {
  absl::BitGen random;
  return absl::StrCat(folder, "/", kPrefix,
                      absl::Hex(absl::Uniform<uint64_t>(random), absl::kZeroPad16));
}

}  // namespace

ScratchFile::ScratchFile(const std::string& folder) : path_(NewPath(folder)) {}

ScratchFile::~ScratchFile() {
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

void ScratchFile::RemoveLeftOver(const std::string& folder) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (!absl::StartsWith(entry.path().filename().string(), kPrefix)) continue;
    std::filesystem::remove(entry.path(), ignored);
  }
}

}  // namespace hypermap::server
