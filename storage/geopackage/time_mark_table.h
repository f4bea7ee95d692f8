// hypermap_time_marks: how the times of commits relate to the time that passed.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_TIME_MARK_TABLE_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_TIME_MARK_TABLE_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/map_store.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// Creates the table.
extern const char kCreateTimeMarks[];

// In the order in which they were inserted. DATA_LOSS when a row is damaged.
absl::StatusOr<std::vector<TimeMark>> ReadTimeMarks(Database* database);

// Inserts a mark, and removes all but the newest of those with passed < `forget_before`, within a
// transaction of the caller.
absl::Status InsertTimeMark(Database* database, const TimeMark& mark, absl::Duration forget_before);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_TIME_MARK_TABLE_H_
