#include "client_libs/cli/file_formats.h"

#include <filesystem>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::cli {
namespace {

struct KnownFormat {
  const char* name;
  const char* extension;
  ExportFormat format;
};

// If a format has several extensions, the first is the usual one.
constexpr KnownFormat kFormats[] = {
    {"hmap", ".hmap", client::FileFormat::kHmap},
    {"nav2", ".yaml", client::FileFormat::kNav2},
    {"nav2", ".yml", client::FileFormat::kNav2},
    {"geojson", ".geojson", client::FileFormat::kGeoJson},
    {"geojson", ".json", client::FileFormat::kGeoJson},
    {"gpkg", ".gpkg", GeoPackage{}},
    {"mcap", ".mcap", Mcap{}},
};

}  // namespace

absl::StatusOr<ExportFormat> ExportFormatOf(const std::string& name, const std::string& path) {
  const std::string extension =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  for (const KnownFormat& known : kFormats) {
    if (name.empty() ? extension == known.extension : name == known.name) return known.format;
  }
  if (!name.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("unknown format \"", name, "\""));
  }
  return absl::InvalidArgumentError(
      absl::StrCat("the extension of \"", path, "\" is no known format; specify --format"));
}

absl::StatusOr<client::FileFormat> ImportFormatOf(const std::string& name,
                                                  const std::string& path) {
  HYPERMAP_ASSIGN_OR_RETURN(const ExportFormat format, ExportFormatOf(name, path));
  if (const auto* interchange = std::get_if<client::FileFormat>(&format)) return *interchange;
  if (std::holds_alternative<Mcap>(format)) {
    return absl::InvalidArgumentError("an MCAP file can't be imported; see hypermap-bag");
  }
  return absl::InvalidArgumentError(
      "a GeoPackage can't be imported; it is a whole map: copy it into the server's data folder");
}

}  // namespace hypermap::cli
