// The two files of a nav2 map: a YAML file and the image that it names.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_NAV2_FILES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_NAV2_FILES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cpp/answers.h"

namespace hypermap::cli {

// Reads the YAML file and the image that it names, whose path is relative to the YAML file. Returns
// both with their base names.
absl::StatusOr<std::vector<client::NamedFile>> ReadNav2Files(const std::string& yaml_path);

// Renames exported files so that the YAML file is `yaml_path` and the image is beside it with the
// same stem, and updates the image's name in the YAML. The image comes first. INTERNAL if
// `exported` is not these two files.
absl::StatusOr<std::vector<client::NamedFile>> RenameNav2Files(
    const std::vector<client::NamedFile>& exported, const std::string& yaml_path);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_NAV2_FILES_H_
