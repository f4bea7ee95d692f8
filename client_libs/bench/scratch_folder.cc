#include "client_libs/bench/scratch_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace hypermap::bench {

absl::StatusOr<ScratchFolder> ScratchFolder::Make(const std::string& parent) {
  if (parent.empty()) return ScratchFolder("");
  std::string path = absl::StrCat(parent, "/hypermap-bench-XXXXXX");
  if (mkdtemp(path.data()) == nullptr) {
    return absl::ErrnoToStatus(errno, absl::StrCat(parent, ": no folder can be made"));
  }
  return ScratchFolder(std::move(path));
}

ScratchFolder::ScratchFolder(std::string path) : path_(std::move(path)) {}

ScratchFolder::ScratchFolder(ScratchFolder&& other) noexcept
    : path_(std::exchange(other.path_, "")) {}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

std::string ScratchFolder::OfReplica(int number) const {
  return path_.empty() ? "" : absl::StrCat(path_, "/", number);
}

}  // namespace hypermap::bench
