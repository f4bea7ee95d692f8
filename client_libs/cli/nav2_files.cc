#include "client_libs/cli/nav2_files.h"

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/cli/file_io.h"

namespace hypermap::cli {
namespace {

namespace fs = std::filesystem;

absl::StatusOr<std::string> ImageNamedBy(const std::string& yaml_path, const std::string& yaml) {
  try {
    const YAML::Node root = YAML::Load(yaml);
    if (root.IsMap() && root["image"] && root["image"].IsScalar()) {
      return root["image"].as<std::string>();
    }
    return absl::InvalidArgumentError(absl::StrCat("file \"", yaml_path, "\" names no image"));
  } catch (const YAML::Exception& error) {
    return absl::InvalidArgumentError(absl::StrCat("file \"", yaml_path, "\": ", error.what()));
  }
}

absl::StatusOr<std::string> WithImage(const std::string& yaml, const std::string& image) {
  try {
    YAML::Node root = YAML::Load(yaml);
    root["image"] = image;
    return YAML::Dump(root) + "\n";
  } catch (const YAML::Exception& error) {
    return absl::InternalError(absl::StrCat("the exported YAML: ", error.what()));
  }
}

bool IsYaml(const std::string& name) {
  const std::string extension = fs::path(name).extension();
  return extension == ".yaml" || extension == ".yml";
}

}  // namespace

absl::StatusOr<std::vector<client::NamedFile>> ReadNav2Files(const std::string& yaml_path) {
  HYPERMAP_ASSIGN_OR_RETURN(std::string yaml, ReadFile(yaml_path));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string image_name, ImageNamedBy(yaml_path, yaml));
  const fs::path image_path = fs::path(yaml_path).parent_path() / image_name;
  HYPERMAP_ASSIGN_OR_RETURN(std::string image, ReadFile(image_path));
  return std::vector<client::NamedFile>{{fs::path(yaml_path).filename(), std::move(yaml)},
                                        {image_path.filename(), std::move(image)}};
}

absl::StatusOr<std::vector<client::NamedFile>> RenameNav2Files(
    const std::vector<client::NamedFile>& exported, const std::string& yaml_path) {
  if (exported.size() != 2 || IsYaml(exported[0].name) == IsYaml(exported[1].name)) {
    return absl::InternalError("expected a YAML file and its image in the export");
  }
  const bool yaml_first = IsYaml(exported[0].name);
  const client::NamedFile& yaml = exported[yaml_first ? 0 : 1];
  const client::NamedFile& image = exported[yaml_first ? 1 : 0];
  const fs::path image_path =
      fs::path(yaml_path).replace_extension(fs::path(image.name).extension());
  HYPERMAP_ASSIGN_OR_RETURN(std::string renamed, WithImage(yaml.data, image_path.filename()));
  return std::vector<client::NamedFile>{{image_path, image.data}, {yaml_path, std::move(renamed)}};
}

}  // namespace hypermap::cli
