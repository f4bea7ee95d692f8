// Rows of hypermap.changes with the versions of objects and tiles that they begin and end.
#ifndef HYPERMAP_STORAGE_POSTGRES_CHANGE_PAGE_H_
#define HYPERMAP_STORAGE_POSTGRES_CHANGE_PAGE_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/snapshot.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// A version of an object or tile without its content.
struct LoggedVersion {
  Revision first_revision = 0;
  Revision end_revision = 0;
  int64_t bytes = 0;
};

struct ChangePlace {
  Revision revision = 0;
  int64_t number = 0;

  friend bool operator==(const ChangePlace&, const ChangePlace&) = default;
};

// A row of the table.
//
// A commit changes an object or a tile at most once (AppliedBatch), and none of a layer that it
// deletes (SnapshotEditor). So the change alone ends the version `before` and begins the version
// `after`.
struct LoggedChange {
  ChangePlace place;
  std::string kind;
  int64_t lineage = 0;  // 0: of no layer
  int64_t object_id = 0;
  int64_t tile_row = 0;
  int64_t tile_col = 0;
  std::string detail;  // JSON
  std::optional<LoggedVersion> before;
  std::optional<LoggedVersion> after;
};

struct ChangePage {
  std::vector<LoggedChange> changes;  // in order
  bool may_have_next = false;         // then there are changes
};

// Reads the next changes after a place and up to the revision `last`: about a thousand, or those
// with some megabytes of details. One statement, within a snapshot transaction of the caller.
// DATA_LOSS; errors of Connection.
absl::StatusOr<ChangePage> ReadChangePage(Connection& connection, int64_t map,
                                          const ChangePlace& after, Revision last);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_CHANGE_PAGE_H_
