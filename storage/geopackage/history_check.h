// The part of a map's check that is about its history and its log of changes.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_CHECK_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_CHECK_H_

#include "absl/status/status.h"
#include "storage/finding_list.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// The R*Tree of the boxes of kept versions of objects.
inline constexpr char kObjectBoxesTable[] = "hypermap_object_boxes";

// Adds what is wrong with the kept revisions: gaps, references that lead to nothing, rows that
// can't be decoded, and boxes that are not those of their versions. Errors as
// FindingList::AddDamage.
absl::Status CheckHistory(Database* database, FindingList* findings);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_HISTORY_CHECK_H_
