// Determines file formats from their name or from the extension of a path.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_FILE_FORMATS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_FILE_FORMATS_H_

#include <string>
#include <variant>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"

namespace hypermap::cli {

// The map as it is stored.
struct GeoPackage {};

// The history of the map as messages of ROS 2.
struct Mcap {};

using ExportFormat = std::variant<client::FileFormat, GeoPackage, Mcap>;

// `name` is hmap, nav2, geojson, gpkg or mcap; if empty, the extension of `path` decides.
// INVALID_ARGUMENT if neither is known.
absl::StatusOr<ExportFormat> ExportFormatOf(const std::string& name, const std::string& path);

// The same, without gpkg and mcap.
absl::StatusOr<client::FileFormat> ImportFormatOf(const std::string& name, const std::string& path);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_FILE_FORMATS_H_
