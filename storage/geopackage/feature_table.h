// The table of one semantic layer: a GeoPackage feature table with an R*Tree index.
//
// The index is kept by the triggers that the R*Tree extension prescribes, here as in every program
// that edits the file. SQLite's R*Tree holds 32-bit floats and rounds boxes outwards itself.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/layers/semantic_object.h"
#include "storage/geopackage/sqlite.h"

namespace hypermap::storage {

// Borrows the database.
class FeatureTable {
 public:
  FeatureTable(Database* database, std::string table);

  absl::Status Create();
  absl::Status Drop();

  // Adds the object, or replaces the one of its id.
  absl::Status Put(const SemanticObject& object);
  absl::Status Remove(ObjectId id);

  // All objects by id. DATA_LOSS naming the table and the row.
  absl::StatusOr<std::vector<ObjectPtr>> ReadAll();

 private:
  Database* database_;
  std::string table_;
  std::string insert_sql_;
  std::string update_sql_;
  std::string delete_sql_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_
