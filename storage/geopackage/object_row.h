// The columns of an object: in the table of its layer and in the history of all layers.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_ROW_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_ROW_H_

#include "absl/status/statusor.h"
#include "map/objects/semantic_object.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The columns that ReadObjectRow expects, in this order, after the id and before the version.
inline constexpr char kObjectColumns[] =
    "geom, label, existence, classes, tags, attributes, height_min, height_max, expires_at_ns";
inline constexpr int kObjectIdColumn = 0;
inline constexpr int kObjectVersionColumn = 10;

// Reads an object from a row of the id, kObjectColumns and the version. DATA_LOSS.
absl::StatusOr<ObjectPtr> ReadObjectRow(Statement* row);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_OBJECT_ROW_H_
