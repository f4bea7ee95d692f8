// The table of one semantic layer: a GeoPackage feature table with an R*Tree index.
//
// The index is kept by the triggers that the R*Tree extension prescribes, as in every program that
// edits the file. SQLite's R*Tree holds 32-bit floats and rounds boxes outwards by itself. Many new
// objects at once are written without the triggers, and the index is filled after the table: packed
// in one go where it was empty (packed_index.h), entry by entry otherwise. Later edits use the
// triggers again.
//
// Objects that a revision replaces or removes are copied to hypermap_object_history.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "map/geometry/shape.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"
#include "storage/geopackage/packed_index.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Borrows the database.
class FeatureTable {
 public:
  // `shape_kinds` are the kinds of shape that the layer takes.
  FeatureTable(Database* database, std::string table, int64_t lineage,
               const ShapeKinds& shape_kinds);

  // Creates the table, its index and its triggers.
  absl::Status Create();
  // Copies all objects to the history and drops the table.
  absl::Status Drop(Revision revision);

  // Writes an object that replaces `before`; null: it is new. An object with the same id that
  // another program put there is replaced as well.
  absl::Status Put(const SemanticObject& object, const SemanticObject* before, Revision revision);
  // Writes objects that are all new, ordered by id.
  absl::Status PutNew(absl::Span<const SemanticObject* const> objects, Revision revision);
  absl::Status Remove(ObjectId id, Revision revision);

  // Reads all objects, ordered by id. DATA_LOSS naming the table and the row, also when another
  // program added a shape of a kind that the layer does not take.
  absl::StatusOr<std::vector<ObjectPtr>> ReadAll();

  // Calls `visit` with the id and the object of each row, ordered by id, or with DATA_LOSS for a
  // row that is damaged, until it returns an error.
  using Visit = absl::FunctionRef<absl::Status(ObjectId id, absl::StatusOr<ObjectPtr> object)>;
  absl::Status ForEach(Visit visit);

 private:
  absl::Status PutSorted(absl::Span<const SemanticObject* const> objects, Revision revision);
  // Adds the objects to the index that were written without the triggers.
  absl::Status FillIndex(std::vector<IndexCell> cells);

  // Copies the current version of the object to the history, ending at the revision; false when
  // there is no such object.
  absl::StatusOr<bool> Archive(ObjectId id, Revision end_revision);
  absl::Status ArchiveAll(Revision end_revision);
  absl::Status CheckKind(const Shape& shape) const;

  Database* database_;
  std::string table_;
  int64_t lineage_;
  ShapeKinds shape_kinds_;
  std::string insert_sql_;
  std::string update_sql_;
  std::string update_without_geometry_sql_;
  std::string archive_sql_;
  std::string delete_sql_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_FEATURE_TABLE_H_
