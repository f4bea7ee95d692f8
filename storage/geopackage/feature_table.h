// The table of one semantic layer: a GeoPackage feature table with an R*Tree index.
//
// The index is kept by the triggers that the R*Tree extension prescribes, here as in every program
// that edits the file. SQLite's R*Tree holds 32-bit floats and rounds boxes outwards itself.
//
// They are passed over for many new objects, for which the index is filled after the table: at once
// where it was empty (packed_index.h), and as the triggers take it up from there.
//
// What is replaced or removed by a revision goes to hypermap_object_history.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/layers/semantic_object.h"
#include "map/snapshot.h"
#include "storage/geopackage/packed_index.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Borrows the database.
class FeatureTable {
 public:
  FeatureTable(Database* database, std::string table, int64_t lineage);

  absl::Status Create();
  absl::Status Drop(Revision revision);

  // Puts the object in the place of `before`; null: it is new. An object of its id that another
  // program put there is replaced as well.
  absl::Status Put(const SemanticObject& object, const SemanticObject* before, Revision revision);
  // Puts objects that are all new, by id.
  absl::Status PutNew(absl::Span<const SemanticObject* const> objects, Revision revision);
  absl::Status Remove(ObjectId id, Revision revision);

  // All objects by id. DATA_LOSS naming the table and the row.
  absl::StatusOr<std::vector<ObjectPtr>> ReadAll();

 private:
  absl::Status PutSorted(absl::Span<const SemanticObject* const> objects, Revision revision);
  // Adds to the index what the triggers were not called for.
  absl::Status FillIndex(std::vector<IndexCell> cells);

  // Copies the object as it is to the history, where it ends; false when there is none.
  absl::StatusOr<bool> Archive(ObjectId id, Revision end_revision);
  absl::Status ArchiveAll(Revision end_revision);

  Database* database_;
  std::string table_;
  int64_t lineage_;
  std::string insert_sql_;
  std::string update_sql_;
  std::string update_without_geometry_sql_;
  std::string archive_sql_;
  std::string delete_sql_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_
