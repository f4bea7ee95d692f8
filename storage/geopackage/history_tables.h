// The tables that keep what a map was.
//
// hypermap_object_history and hypermap_tile_history hold what was replaced or removed, each with
// the revision `end_revision` that did so; what holds still is in the layers' own tables. So the
// state at a revision r is, of each object or tile, the version with the smallest end_revision > r,
// else the one that holds now. hypermap_object_boxes finds objects by place, revisions and layer at
// once.
//
// A lineage is a layer from its creation to its deletion; another layer of that name is another
// lineage.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TABLES_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TABLES_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "map/geometry/point.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The receipts, which keep their time so that they may outlive the record of their revision.
extern const char kCreateReceipts[];
extern const char kCreateHistoryTables[];

// Brings a map of schema version 2, which has no history, to version 3: the oldest revision that
// can be asked for is the one it has.
absl::Status AddHistory(Database* database);

// A box in whole millimetres, rounded outwards, as SQLite's 32-bit R*Tree holds it: what lies
// farther out is at its rim.
struct MillimetreBox {
  int64_t min_x = 0;
  int64_t max_x = 0;
  int64_t min_y = 0;
  int64_t max_y = 0;
};
MillimetreBox ToMillimetres(const Box& box);

// The value, or the largest that the R*Tree can hold.
int64_t ClampToInt32(int64_t value);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_TABLES_H_
