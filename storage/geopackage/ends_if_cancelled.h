// Long statements of SQLite that end with the call for which they run.
#ifndef HYPERMAP_STORAGE_GEOPACKAGE_ENDS_IF_CANCELLED_H_
#define HYPERMAP_STORAGE_GEOPACKAGE_ENDS_IF_CANCELLED_H_

#include "base/cancellation/cancellation.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {

// While it lives, statements of the database end with an error when the work of this thread is
// cancelled. SQLite's own error says only that the statement was interrupted: callers ask
// CheckCancelled first.
class EndsIfCancelled {
 public:
  explicit EndsIfCancelled(Database* database) : database_(database) {
    // Steps of SQLite's virtual machine, of which a row takes some ten.
    constexpr int kStepsPerLook = 256;
    sqlite3_progress_handler(
        database_->handle(), kStepsPerLook, [](void* /*unused*/) { return IsCancelled() ? 1 : 0; },
        nullptr);
  }
  ~EndsIfCancelled() { sqlite3_progress_handler(database_->handle(), 0, nullptr, nullptr); }
  EndsIfCancelled(const EndsIfCancelled&) = delete;
  EndsIfCancelled& operator=(const EndsIfCancelled&) = delete;

 private:
  Database* const database_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_GEOPACKAGE_ENDS_IF_CANCELLED_H_
