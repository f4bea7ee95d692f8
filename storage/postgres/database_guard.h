// Notices when the database is not the one that was written last: a restored or an older one, or a
// standby that was promoted.
#ifndef HYPERMAP_STORAGE_POSTGRES_DATABASE_GUARD_H_
#define HYPERMAP_STORAGE_POSTGRES_DATABASE_GUARD_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Which tables these are, and which branch of their history.
struct DatabasePlace {
  // The cluster, the database and the table, by the numbers that PostgreSQL gives them. A dump that
  // is restored gets others, also in the same cluster.
  std::string tables;
  // PostgreSQL begins a new timeline when a standby is promoted or a recovery ends at a chosen
  // point.
  int64_t timeline = 0;

  bool operator==(const DatabasePlace&) const = default;
};

// Records in the database where it is now.
absl::Status RecordPlace(Connection* connection);

// A row of the database tells where it was written last. If it is elsewhere now, revisions may be
// missing that were acknowledged or shown: all maps become other incarnations, before any of them
// is used, unless this process has used the database at the place that the row tells, and a standby
// confirmed all commits there. Then revisions are missing only if the wrong standby was promoted,
// which servers notice for each map (MapStore::RenewIncarnation). See docs/decisions/043. Thread
// safe.
class DatabaseGuard {
 public:
  explicit DatabaseGuard(std::string server_id) : server_id_(std::move(server_id)) {}

  // The first Check of a process. If other servers may have lived through a change of the place,
  // leaves it to them for a while.
  absl::Status Begin(Connection* connection);

  // To be called with each new connection to the primary before it is used, and from time to time.
  // UNAVAILABLE, also if it is a standby; other errors of the connection.
  absl::Status Check(Connection* connection);

  // Notes why a map has this incarnation since a moment ago.
  void AddNote(uint64_t incarnation, const std::string& reason);
  // Returns the note about the incarnation, once; nullopt if there is none.
  std::optional<std::string> TakeNote(uint64_t incarnation);

 private:
  // Where the database was written last, and where it is.
  struct Look {
    DatabasePlace written;
    DatabasePlace now;
  };
  static absl::StatusOr<Look> LookAt(Connection* connection);
  // Goes on at the place where the database is now, with or without other incarnations.
  absl::Status Accept(Connection* connection) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Vouches(const Look& look) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string server_id_;
  Mutex mutex_;
  std::optional<DatabasePlace> accepted_ ABSL_GUARDED_BY(mutex_);
  // Whether a standby confirmed commits there when this process looked last.
  bool are_confirmed_ ABSL_GUARDED_BY(mutex_) = false;
  Mutex notes_mutex_;
  std::map<uint64_t, std::string> notes_ ABSL_GUARDED_BY(notes_mutex_);
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_DATABASE_GUARD_H_
