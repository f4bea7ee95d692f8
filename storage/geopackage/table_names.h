// Names of the tables that hold the content of layers.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Whether a table of that name may hold a layer. It consists of letters, digits and '_', and is
// neither a keyword of SQL (for programs that do not quote names) nor a name that belongs to
// SQLite, GeoPackage, QGIS or Hypermap itself.
bool IsLayerTableName(absl::string_view name);

// Chooses the name for the table of a new layer: the layer's own name, changed as far as
// IsLayerTableName requires and until it is free in the database. Names differ by more than case.
absl::StatusOr<std::string> ChooseTableName(Database* database, absl::string_view layer_name);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_
