#include "storage/interchange/map_server_yaml.h"

#include <array>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/interchange/number_text.h"
#include "storage/interchange/yaml_document.h"

namespace hypermap::storage {
namespace {

constexpr std::array<std::pair<OccupancyMode, const char*>, 3> kModes{{
    {OccupancyMode::kTrinary, "trinary"},
    {OccupancyMode::kScale, "scale"},
    {OccupancyMode::kRaw, "raw"},
}};

absl::StatusOr<OccupancyMode> ParseMode(absl::string_view text) {
  const std::string word = absl::AsciiStrToLower(text);
  for (const auto& [mode, name] : kModes) {
    if (word == name) return mode;
  }
  return absl::InvalidArgumentError(
      absl::StrCat("mode \"", text, "\" is none of trinary, scale, raw"));
}

absl::Status ReadThreshold(const YAML::Node& map, const char* key, double& threshold) {
  if (!Value(map, key).IsDefined()) return absl::OkStatus();
  const absl::StatusOr<double> number = ReadNumber(map, key);
  if (number.ok()) threshold = *number;
  return number.status();
}

absl::Status ReadPixelRules(const YAML::Node& map, MapServerYaml& yaml) {
  HYPERMAP_RETURN_IF_ERROR(ReadThreshold(map, "occupied_thresh", yaml.occupied_thresh));
  HYPERMAP_RETURN_IF_ERROR(ReadThreshold(map, "free_thresh", yaml.free_thresh));
  if (Value(map, "negate").IsDefined()) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool negate, ReadFlag(map, "negate"));
    yaml.negate = negate;
  }
  if (Value(map, "mode").IsDefined()) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::string text, ReadText(map, "mode"));
    HYPERMAP_ASSIGN_OR_RETURN(const OccupancyMode mode, ParseMode(text));
    yaml.mode = mode;
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MapServerYaml> ParseMapServerYaml(absl::string_view text) {
  HYPERMAP_ASSIGN_OR_RETURN(const YAML::Node map, ParseYaml(text));
  HYPERMAP_RETURN_IF_ERROR(CheckMap(map, "the YAML"));
  MapServerYaml yaml;
  HYPERMAP_ASSIGN_OR_RETURN(std::string image, ReadText(map, "image"));
  yaml.image = std::move(image);
  HYPERMAP_ASSIGN_OR_RETURN(const double resolution, ReadNumber(map, "resolution"));
  if (resolution <= 0.0) return absl::InvalidArgumentError("resolution is not positive");
  HYPERMAP_ASSIGN_OR_RETURN(const YamlPose origin, ReadPose(map, "origin"));
  yaml.geometry = {PlanarTransform(origin.x, origin.y, origin.yaw), resolution};
  HYPERMAP_RETURN_IF_ERROR(ReadPixelRules(map, yaml));
  return yaml;
}

std::string FormatMapServerYaml(const MapServerYaml& yaml) {
  const PlanarTransform& origin = yaml.geometry.layer_from_grid;
  const char* mode = kModes[static_cast<size_t>(yaml.mode)].second;
  return absl::StrCat("image: ", QuoteYaml(yaml.image),                                 //
                      "\nresolution: ", FormatNumber(yaml.geometry.resolution_m),       //
                      "\norigin: [", FormatNumber(origin.x()), ", ",                    //
                      FormatNumber(origin.y()), ", ", FormatNumber(origin.yaw()), "]",  //
                      "\nnegate: ", yaml.negate ? 1 : 0,                                //
                      "\noccupied_thresh: ", FormatNumber(yaml.occupied_thresh),        //
                      "\nfree_thresh: ", FormatNumber(yaml.free_thresh), "\nmode: ", mode, "\n");
}

}  // namespace hypermap::storage
