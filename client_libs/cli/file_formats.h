// Which format a file has, by its name or by the one that was asked for.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_FILE_FORMATS_H_
#define HYPERMAP_CLIENT_LIBS_CLI_FILE_FORMATS_H_

#include <string>
#include <variant>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"

namespace hypermap::cli {

// The map as it is stored.
struct GeoPackage {};

using ExportFormat = std::variant<client::FileFormat, GeoPackage>;

// `name` is hmap, nav2, geojson or gpkg; empty: by the extension of `path`. INVALID_ARGUMENT when
// neither tells.
absl::StatusOr<ExportFormat> ExportFormatOf(const std::string& name, const std::string& path);

// As ExportFormatOf, without gpkg.
absl::StatusOr<client::FileFormat> ImportFormatOf(const std::string& name, const std::string& path);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_FILE_FORMATS_H_
