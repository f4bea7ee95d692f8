// Which table holds which layer.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Whether a layer may be kept in a table of that name: letters, digits and '_', no keyword of SQL
// (programs that do not quote must get by), and not of those that belong to SQLite, GeoPackage,
// QGIS or Hypermap itself.
bool IsLayerTableName(absl::string_view name);

// A name for the table of a new layer: the layer's own as far as IsLayerTableName has it, and not
// taken in the database, where "A" and "a" are the same.
absl::StatusOr<std::string> ChooseTableName(Database* database, absl::string_view layer_name);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_
