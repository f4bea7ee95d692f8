// The tables of a map's history.
//
// hypermap_object_history and hypermap_tile_history hold the versions of objects and tiles that
// were replaced or removed, each with the revision `end_revision` that did so. Versions that still
// hold are in the layers' own tables. The state of an object or tile at revision r is therefore its
// version with the smallest end_revision > r, or else the current one. hypermap_object_boxes finds
// objects by place, revision and layer in one search.
//
// A lineage is a layer from its creation to its deletion; another layer of the same name is another
// lineage.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TABLES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TABLES_H_

#include <array>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/geometry/point.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Creates the table of receipts. Each row has its own time, so that it may outlive its revision.
extern const char kCreateReceipts[];
extern const char kCreateHistoryTables[];

// A box in whole millimetres, rounded outwards, as SQLite's 32-bit R*Tree holds it. Coordinates
// beyond its range lie on its rim.
struct MillimetreBox {
  int64_t min_x = 0;
  int64_t max_x = 0;
  int64_t min_y = 0;
  int64_t max_y = 0;
};
MillimetreBox ToMillimetres(const Box& box);

// The value, or the largest that the R*Tree can hold.
int64_t ClampToInt32(int64_t value);

// The columns of hypermap_object_boxes after the id, in their order.
using VersionBox = std::array<int64_t, 8>;
// The box of a version of an object, whose geometry is a blob of geometry_blob.h. A geometry that
// can't be decoded gets a box round everything, so that every search of the history finds it and
// reports the damage.
VersionBox BoxOfVersion(absl::string_view geometry, int64_t first_revision, int64_t end_revision,
                        int64_t lineage);
absl::Status InsertVersionBox(Database* database, int64_t id, const VersionBox& box);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TABLES_H_
