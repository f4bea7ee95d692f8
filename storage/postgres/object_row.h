// The columns of a version of an object in hypermap.objects.
#ifndef HYPERMAP_STORAGE_POSTGRES_OBJECT_ROW_H_
#define HYPERMAP_STORAGE_POSTGRES_OBJECT_ROW_H_

#include "absl/status/statusor.h"
#include "map/objects/semantic_object.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// The columns that ReadObjectRow expects, in this order; first_revision is the object's version.
//
// Rows are written with the columns of EncodeObject (storage/encoding/object_columns.h). The column
// `bounds` is made of four float8, each of which may be a column of unnest:
// box(point(min_x, min_y), point(max_x, max_y)). It then has exactly the box of the shape.
inline constexpr char kObjectColumns[] =
    "object_id, first_revision, shape, label, existence, classes, tags, attributes, height_min, "
    "height_max, expires_at_ns";
inline constexpr int kNumObjectColumns = 11;

// Reads an object from the columns that begin with `first_column`. DATA_LOSS; INVALID_ARGUMENT for
// an object that no store would have been given.
absl::StatusOr<ObjectPtr> ReadObjectRow(Rows* row, int first_column = 0);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_OBJECT_ROW_H_
