// The rows of hypermap.maps: which maps there are, and which server owns each.
#ifndef HYPERMAP_STORAGE_POSTGRES_MAP_ROW_H_
#define HYPERMAP_STORAGE_POSTGRES_MAP_ROW_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "storage/libpq/connection.h"
#include "storage/map_store.h"
#include "storage/postgres/owned_map.h"

namespace hypermap::storage::postgres {

// The application_name of the sessions of a server.
std::string ApplicationNameOf(const std::string& server_id);

struct MapRow {
  int64_t id = 0;
  MapHeader header;
  Revision revision = 0;
  Revision oldest_revision = 0;
  int64_t next_lineage = 1;
  std::string owner;      // empty: none
  bool is_owned = false;  // whether the owner's lease lasts
  // The end of that lease, in microseconds since the Unix epoch; 0 if there is none.
  int64_t lease_until_us = 0;
  int64_t epoch = 0;
  int64_t last_write = 0;
};

// Reads the row of the map with this name; nullopt if there is none. kUntilCommit: the row is
// locked until the end of the transaction. DATA_LOSS.
enum class RowLock { kNone, kUntilCommit };
absl::StatusOr<std::optional<MapRow>> FindMap(Connection* connection, const std::string& name,
                                              RowLock lock = RowLock::kUntilCommit);

// Reads where the history of a map stands, also of one that was deleted, until its rows are
// removed: then UNAVAILABLE; DATA_LOSS.
absl::StatusOr<MapPosition> ReadPosition(Connection* connection, int64_t map);

// Ends the sessions of the owner of a map, if its lease is over. A process that was stopped in the
// middle of a transaction would keep the row locked.
absl::Status EndSessionsOfLostOwner(Connection* connection, const std::string& map);

// Adds a map that `owner` owns, with this number of its last transaction. Nothing if there is a map
// of that name.
absl::Status InsertMap(Connection* connection, const MapHeader& header, const std::string& owner,
                       int64_t last_write);

// Makes `owner` the owner of a map, of another epoch. REQUIRES: the row is locked.
absl::StatusOr<OwnedMap::Row> TakeMap(Connection* connection, const MapRow& row,
                                      const std::string& owner);

// Reads which servers live, and which of them own which maps, in two statements. A map that is not
// complete yet is left out.
absl::StatusOr<Survey> ReadSurvey(Connection* connection);

// Reads the newest revisions of those of the maps that there are and are complete, in one
// statement.
absl::StatusOr<std::map<std::string, NewestRevision>> ReadNewestRevisions(
    Connection* connection, const std::vector<std::string>& names);

// Gives all maps that others may have seen other incarnations, and ends their epochs. Returns the
// incarnations. The rows are locked until the end of the transaction.
absl::StatusOr<std::vector<uint64_t>> RenewAllIncarnations(Connection* connection);

// Gives one map another incarnation, and ends its epoch, if it has `incarnation` and is at a
// revision before `shown`. Returns the incarnation that it has then; nullopt if nothing was done.
absl::StatusOr<std::optional<uint64_t>> RenewIncarnation(Connection* connection,
                                                         const std::string& name,
                                                         uint64_t incarnation, Revision shown);

// Gives an unfinished copy a name, which makes it a map. No other server than `owner` can open it
// until that has given it back. REQUIRES: the row is locked.
absl::Status PublishCopy(Connection* connection, int64_t map, const std::string& name,
                         const std::string& owner);

// Removes the names of unfinished copies that are hidden (HiddenNameOf) and that nobody will finish
// any more: those of servers that do not live, or of `server`.
absl::Status RemoveHiddenCopies(Connection* connection, const std::string& server);

// Removes the name of one such copy. OK if there is none.
absl::Status RemoveHidden(Connection* connection, const std::string& hidden);

// A name for the copy that is to become the map `name`. No map can have such a name.
std::string HiddenNameOf(const std::string& name);

// Removes the name of a map, which makes it a deleted one, and ends its epoch. REQUIRES: the row is
// locked.
absl::Status RemoveName(Connection* connection, int64_t map);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_MAP_ROW_H_
