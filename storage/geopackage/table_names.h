// Names of the tables that hold the content of layers.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_

#include <string>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Returns whether a table of that name may hold a layer. It consists of letters, digits and '_',
// and is neither a keyword of SQL (for programs that do not quote names) nor a name that belongs to
// SQLite, GeoPackage, QGIS or Hypermap itself.
bool IsLayerTableName(absl::string_view name);

// The names in a database that a new layer's table can't have. Reading them takes time in
// proportion to the tables of the database; taking a name does not.
class TableNames {
 public:
  static absl::StatusOr<TableNames> Read(Database* database);

  // Takes a name for the table of a new layer: the layer's own name, changed as far as
  // IsLayerTableName requires and until it is free. Names differ by more than case.
  std::string Take(absl::string_view layer_name);
  // Must be called when a layer's table was removed.
  void GiveBack(absl::string_view table);

 private:
  absl::flat_hash_set<std::string> taken_;  // in lower case
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TABLE_NAMES_H_
