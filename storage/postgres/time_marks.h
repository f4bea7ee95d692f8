// hypermap.time_marks: how the times of commits relate to the time that passed.
#ifndef HYPERMAP_STORAGE_POSTGRES_TIME_MARKS_H_
#define HYPERMAP_STORAGE_POSTGRES_TIME_MARKS_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/libpq/connection.h"
#include "storage/map_store.h"
#include "storage/postgres/owned_map.h"

namespace hypermap::storage::postgres {

// In the order in which they were added. DATA_LOSS when a row is damaged.
absl::StatusOr<std::vector<TimeMark>> ReadTimeMarks(Connection& connection, int64_t map);

// Adds a mark, and removes all but the newest of those with passed < `forget_before`, durably.
absl::Status AddTimeMark(OwnedMap& owned, const TimeMark& mark, absl::Duration forget_before);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_TIME_MARKS_H_
