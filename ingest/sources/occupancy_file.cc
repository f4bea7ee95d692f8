#include "ingest/sources/occupancy_file.h"

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "ingest/sources/input_file.h"
#include "map/edits/apply.h"
#include "storage/interchange/nav2.h"

namespace hypermap::ingest {
namespace {

namespace fs = std::filesystem;

constexpr char kLayer[] = "occupancy";

absl::StatusOr<std::string> ImageNamedBy(const std::string& yaml) {
  try {
    const YAML::Node image = YAML::Load(yaml)["image"];
    if (image && image.IsScalar()) return image.as<std::string>();
  } catch (const YAML::Exception& e) {
    return absl::InvalidArgumentError(e.what());
  }
  return absl::InvalidArgumentError("it names no image");
}

// The file is the robot's own, so it may be larger than what a server accepts from a client.
Limits LimitsOfOwnFiles() {
  Limits limits;
  limits.max_cells = int64_t{1} << 28;
  return limits;
}

absl::StatusOr<std::shared_ptr<const GridLayer>> Decode(const std::string& yaml_path) {
  HYPERMAP_ASSIGN_OR_RETURN(std::string yaml, ReadFile(yaml_path));
  HYPERMAP_ASSIGN_OR_RETURN(const std::string name, ImageNamedBy(yaml));
  const fs::path image_path = fs::path(yaml_path).parent_path() / name;
  HYPERMAP_ASSIGN_OR_RETURN(std::string image, ReadFile(image_path.string()));
  HYPERMAP_ASSIGN_OR_RETURN(
      const storage::ImportedMap imported,
      storage::DecodeNav2({{fs::path(yaml_path).filename().string(), std::move(yaml)},
                           {image_path.filename().string(), std::move(image)}},
                          kLayer, "", LimitsOfOwnFiles()));
  HYPERMAP_ASSIGN_OR_RETURN(const AppliedBatch applied,
                            Apply(Snapshot(), imported.batch, LimitsOfOwnFiles()));
  auto layer = AsGrid(applied.snapshot->layers.at(kLayer));
  if (layer == nullptr) return absl::InternalError("the imported layer is no grid");
  return layer;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const GridLayer>> ReadOccupancy(const std::string& yaml_path) {
  absl::StatusOr<std::shared_ptr<const GridLayer>> layer = Decode(yaml_path);
  if (layer.ok()) return layer;
  return absl::Status(layer.status().code(),
                      absl::StrCat("occupancy ", yaml_path, ": ", layer.status().message()));
}

}  // namespace hypermap::ingest
