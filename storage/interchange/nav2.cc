#include "storage/interchange/nav2.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "map/layers/grid_layer.h"
#include "storage/interchange/map_server_yaml.h"
#include "storage/interchange/occupancy_member.h"
#include "storage/interchange/occupancy_pixels.h"
#include "storage/interchange/pgm.h"
#include "storage/interchange/png_codec.h"
#include "storage/interchange/repair_log.h"
#include "storage/interchange/status_context.h"

namespace hypermap::storage {
namespace {

// The thresholds of map_saver; its pixel 205 (unknown) lies between them.
constexpr double kTrinaryOccupied = 0.65;
constexpr double kTrinaryFree = 0.196;

std::string BaseName(absl::string_view path) {
  const size_t slash = path.find_last_of("/\\");
  return std::string(slash == absl::string_view::npos ? path : path.substr(slash + 1));
}

bool IsYaml(const NamedFile& file) {
  const std::string name = absl::AsciiStrToLower(file.name);
  return absl::EndsWith(name, ".yaml") || absl::EndsWith(name, ".yml");
}

absl::StatusOr<const NamedFile*> FindYaml(const std::vector<NamedFile>& files) {
  const NamedFile* found = nullptr;
  for (const NamedFile& file : files) {
    if (!IsYaml(file)) continue;
    if (found != nullptr) {
      return absl::InvalidArgumentError(
          absl::StrCat("files: two YAMLs, \"", found->name, "\" and \"", file.name, "\""));
    }
    found = &file;
  }
  if (found == nullptr) return absl::InvalidArgumentError("files: no .yaml among them");
  return found;
}

absl::Status CheckSizes(const std::vector<NamedFile>& files, const Limits& limits) {
  int64_t bytes = 0;
  for (const NamedFile& file : files) bytes += static_cast<int64_t>(file.data.size());
  if (bytes <= limits.max_unpacked_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("files: ", bytes,
                                                   " bytes, more than --max_unpacked_bytes (",
                                                   limits.max_unpacked_bytes, ")"));
}

}  // namespace

absl::StatusOr<ImportedMap> DecodeNav2(const std::vector<NamedFile>& files,
                                       const std::string& layer, const std::string& frame_id,
                                       const Limits& limits) {
  HYPERMAP_RETURN_IF_ERROR(CheckSizes(files, limits));
  HYPERMAP_ASSIGN_OR_RETURN(const NamedFile* const yaml_file, FindYaml(files));
  const absl::StatusOr<MapServerYaml> yaml = ParseMapServerYaml(yaml_file->data);
  if (!yaml.ok()) return At(yaml_file->name, yaml.status());
  const std::string image_name = BaseName(yaml->image);
  const auto image = std::find_if(files.begin(), files.end(), [&](const NamedFile& file) {
    return BaseName(file.name) == image_name;
  });
  if (image == files.end()) {
    return absl::InvalidArgumentError(
        absl::StrCat(yaml_file->name, ": its image \"", image_name, "\" is not among the files"));
  }

  ImportedMap imported;
  imported.layers.push_back(layer);
  if (!frame_id.empty()) imported.frame_id = frame_id;
  RepairLog repairs;
  for (const NamedFile& file : files) {
    const bool used = &file == yaml_file || &file == &*image;
    if (!used) repairs.Add(absl::StrCat("file \"", file.name, "\" is not named by the YAML"));
  }
  imported.repairs = std::move(repairs).Take();
  int64_t pixels_left = limits.max_cells;
  const absl::Status status =
      AppendOccupancyLayer(layer, frame_id, *yaml, image->data, pixels_left, imported.batch.edits);
  if (!status.ok()) return At(yaml_file->name, status);
  return imported;
}

namespace {

// The values that a trinary image can't keep.
int64_t CountBetween(const GridPicture& picture) {
  return std::count_if(picture.percents.begin(), picture.percents.end(), [](uint8_t percent) {
    return percent != 0 && percent != 100 && percent != PixelMeaning::kUnknown;
  });
}

absl::StatusOr<std::shared_ptr<const GridLayer>> GetOccupancy(const Snapshot& snapshot,
                                                              const std::string& name) {
  HYPERMAP_ASSIGN_OR_RETURN(const LayerPtr layer, snapshot.GetLayer(name));
  if (layer->spec().kind != LayerKind::kOccupancy) {
    return absl::FailedPreconditionError(absl::StrCat("layer \"", name, "\" is of the kind ",
                                                      LayerKindName(layer->spec().kind),
                                                      ", no occupancy grid"));
  }
  auto grid = std::static_pointer_cast<const GridLayer>(layer);
  if (grid->extent().empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("layer \"", name, "\" is empty, an image needs pixels"));
  }
  return grid;
}

absl::StatusOr<std::string> EncodeImage(const GridPicture& picture, const GridLayer& layer,
                                        bool scale, Nav2Image format) {
  if (scale) return EncodePng(ScaleImage(picture), PngChannels::kGreyAlpha);
  const GreyAlphaImage image = TrinaryImage(picture, layer.spec().thresholds);
  if (format == Nav2Image::kPgm) return EncodePgm(image);
  // Without alpha: nav2 takes the mean of all channels in the trinary mode.
  return EncodePng(image, PngChannels::kGrey);
}

}  // namespace

absl::StatusOr<ExportedFiles> EncodeNav2(const Snapshot& snapshot, const std::string& layer,
                                         Nav2Image image) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::shared_ptr<const GridLayer> grid,
                            GetOccupancy(snapshot, layer));
  HYPERMAP_ASSIGN_OR_RETURN(const GridPicture picture,
                            TakePicture(*grid, FixedLimits::kMaxExportPixels));

  ExportedFiles exported;
  const std::string place = absl::StrCat("layer \"", layer, "\": ");
  ReportLostByImage(*grid, exported.omissions);
  if (picture.num_rounded > 0) {
    exported.omissions.push_back(
        absl::StrCat(place, picture.num_rounded, " values rounded to 1/100"));
  }
  const int64_t between = CountBetween(picture);
  const bool scale = image == Nav2Image::kPng && between > 0;
  if (!scale && between > 0) {
    exported.omissions.push_back(absl::StrCat(
        place, between, " values between 0 and 1 made free, occupied or unknown (PNG keeps them)"));
  }
  HYPERMAP_ASSIGN_OR_RETURN(std::string data, EncodeImage(picture, *grid, scale, image));
  const MapServerYaml yaml{.image = layer + (image == Nav2Image::kPgm ? ".pgm" : ".png"),
                           .geometry = picture.geometry,
                           .negate = false,
                           .occupied_thresh = scale ? 1.0 : kTrinaryOccupied,
                           .free_thresh = scale ? 0.0 : kTrinaryFree,
                           .mode = scale ? OccupancyMode::kScale : OccupancyMode::kTrinary};
  exported.files.push_back({layer + ".yaml", FormatMapServerYaml(yaml)});
  exported.files.push_back({yaml.image, std::move(data)});
  return exported;
}

}  // namespace hypermap::storage
