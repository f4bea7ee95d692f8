// The two files of a nav2 map: a YAML that names an image beside it.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_NAV2_FILES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_NAV2_FILES_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cpp/answers.h"

namespace hypermap::cli {

// The YAML at `yaml_path` and the image that it names, which is looked for relative to the YAML.
// Both under their base names.
absl::StatusOr<std::vector<client::NamedFile>> ReadNav2Files(const std::string& yaml_path);

// `exported` renamed so that the YAML is `yaml_path` and the image lies beside it under the same
// stem, which the YAML names. The image comes first. INTERNAL when these are not the two files.
absl::StatusOr<std::vector<client::NamedFile>> RenameNav2Files(
    const std::vector<client::NamedFile>& exported, const std::string& yaml_path);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_NAV2_FILES_H_
