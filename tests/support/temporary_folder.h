// A folder for the files of one test, so that tests that run in parallel do not interfere.
#ifndef HYPERMAP_TESTS_SUPPORT_TEMPORARY_FOLDER_H_
#define HYPERMAP_TESTS_SUPPORT_TEMPORARY_FOLDER_H_

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

namespace hypermap::testing {

// Creates a unique folder, and removes it at destruction. Throws std::system_error if none can be
// created.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(std::filesystem::temp_directory_path() / "hypermap_XXXXXX") {
    if (mkdtemp(path_.data()) == nullptr) {
      throw std::system_error(errno, std::generic_category(), path_);
    }
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

  // Names of the entries of the folder, sorted.
  std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  // Writes a file, creating the folders above it.
  void Write(const std::string& name, const std::string& data) const {
    const std::filesystem::path path = *this / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << data;
  }

 private:
  std::string path_;
};

}  // namespace hypermap::testing

#endif  // HYPERMAP_TESTS_SUPPORT_TEMPORARY_FOLDER_H_
