#include "storage/postgres/map_row.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "base/status/status_macros.h"
#include "storage/incarnation.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kApplication[] = "hypermapd ";

constexpr char kFindMap[] = R"sql(
SELECT m.id, name, frame_id, created_at_ns, request_id, incarnation, provisional, revision,
    oldest_revision, coalesce(owner, ''), epoch, last_write,
    coalesce(s.lease_until > clock_timestamp(), false),
    coalesce((extract(epoch FROM s.lease_until) * 1000000)::bigint, 0), next_lineage,
    unfinished_copy
  FROM hypermap.maps AS m LEFT JOIN hypermap.servers AS s ON s.id = m.owner
  WHERE name = $1
)sql";
constexpr char kEndSessions[] = R"sql(
SELECT pg_terminate_backend(a.pid)
  FROM hypermap.maps AS m CROSS JOIN pg_stat_activity AS a
  WHERE m.name = $1 AND a.datname = current_database() AND a.application_name = $2 || m.owner
    AND NOT EXISTS (SELECT 1 FROM hypermap.servers AS s
      WHERE s.id = m.owner AND s.lease_until > clock_timestamp())
)sql";
constexpr char kLockMap[] = "SELECT id FROM hypermap.maps WHERE name = $1 FOR UPDATE";
constexpr char kServers[] = R"sql(
SELECT id, address, (extract(epoch FROM lease_until - clock_timestamp()) * 1000000)::bigint,
    draining
  FROM hypermap.servers WHERE lease_until > clock_timestamp() ORDER BY id
)sql";
constexpr char kMaps[] = R"sql(
SELECT m.name, m.incarnation, m.revision, coalesce(s.id, '')
  FROM hypermap.maps AS m LEFT JOIN hypermap.servers AS s
    ON s.id = m.owner AND s.lease_until > clock_timestamp()
  WHERE m.name IS NOT NULL AND NOT m.provisional AND NOT m.unfinished_copy
  ORDER BY m.name
)sql";
constexpr char kNewest[] = R"sql(
SELECT name, incarnation, revision FROM hypermap.maps WHERE name = ANY ($1) AND NOT provisional
)sql";
constexpr char kInsertMap[] = R"sql(
INSERT INTO hypermap.maps (name, frame_id, created_at_ns, request_id, incarnation, provisional,
    revision, oldest_revision, next_object_id, next_lineage, epoch, last_write, owner,
    unfinished_copy)
  VALUES ($1, $2, $3, $4, $5, $6, 0, 0, 1, 1, 1, $7, $8, $9)
  ON CONFLICT (name) DO NOTHING
)sql";
constexpr char kTakeMap[] =
    "UPDATE hypermap.maps SET owner = $2, epoch = epoch + 1 WHERE id = $1 RETURNING epoch";
constexpr char kLockMaps[] = R"sql(
SELECT id FROM hypermap.maps WHERE name IS NOT NULL AND NOT provisional AND NOT unfinished_copy
  ORDER BY id FOR UPDATE
)sql";
// An owner of a time that is lost may have the next epochs, so that one far ahead is taken.
constexpr char kRenewMaps[] = R"sql(
UPDATE hypermap.maps AS m SET incarnation = n.incarnation, owner = NULL,
    epoch = epoch + 1 + (random() * 1000000000)::bigint
  FROM unnest($1::bigint[], $2::bigint[]) AS n (id, incarnation) WHERE m.id = n.id
)sql";
constexpr char kRemoveName[] =
    "UPDATE hypermap.maps SET name = NULL, owner = NULL, epoch = epoch + 1 WHERE id = $1";

constexpr char kPublishCopy[] = R"sql(
UPDATE hypermap.maps SET name = $2, unfinished_copy = false, provisional = false, owner = $3,
    epoch = epoch + 1
  WHERE id = $1
)sql";
constexpr char kRemoveHiddenCopies[] = R"sql(
UPDATE hypermap.maps AS m SET name = NULL, owner = NULL, epoch = epoch + 1
  WHERE name LIKE '.%' AND (owner = $1 OR NOT EXISTS (
    SELECT 1 FROM hypermap.servers AS s
      WHERE s.id = m.owner AND s.lease_until > clock_timestamp()))
)sql";

// Gives the maps other incarnations, and returns these. REQUIRES: the rows are locked.
absl::StatusOr<std::vector<uint64_t>> Renew(Connection* connection,
                                            const std::vector<int64_t>& ids) {
  std::vector<uint64_t> renewed;
  std::vector<int64_t> column;
  for (size_t i = 0; i < ids.size(); ++i) {
    renewed.push_back(NewIncarnation());
    column.push_back(static_cast<int64_t>(renewed.back()));
  }
  HYPERMAP_RETURN_IF_ERROR(
      connection->Query(kRenewMaps, absl::MakeConstSpan(ids), absl::MakeConstSpan(column))
          .status());
  return renewed;
}

}  // namespace

absl::StatusOr<std::optional<MapRow>> FindMap(Connection* connection, const std::string& name,
                                              RowLock lock) {
  if (lock == RowLock::kUntilCommit) {
    // A statement of its own: one that waits for a lock reads the other rows, such as leases, as
    // they were before.
    HYPERMAP_RETURN_IF_ERROR(connection->Query(kLockMap, name).status());
  }
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kFindMap, name));
  if (!rows.Next()) return std::nullopt;
  MapRow row;
  row.id = rows.Int64(0);
  row.header.name = std::string(rows.Text(1));
  row.header.frame_id = std::string(rows.Text(2));
  row.header.created_at = absl::FromUnixNanos(rows.Int64(3));
  row.header.request_id = std::string(rows.Text(4));
  row.header.incarnation = static_cast<uint64_t>(rows.Int64(5));
  row.header.provisional = rows.Bool(6);
  row.revision = rows.Int64(7);
  row.oldest_revision = rows.Int64(8);
  row.owner = std::string(rows.Text(9));
  row.epoch = rows.Int64(10);
  row.last_write = rows.Int64(11);
  row.is_owned = rows.Bool(12);
  row.lease_until_us = rows.Int64(13);
  row.next_lineage = rows.Int64(14);
  row.header.unfinished_copy = rows.Bool(15);
  if (!rows.row_status().ok()) {
    return absl::DataLossError(
        absl::StrCat("hypermap.maps, map ", name, ": ", rows.row_status().message()));
  }
  return row;
}

absl::StatusOr<MapPosition> ReadPosition(Connection* connection, int64_t map) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                            connection->Query("SELECT oldest_revision, revision, next_object_id "
                                              "FROM hypermap.maps "
                                              "WHERE id = $1 AND incarnation <> 0",
                                              map));
  if (!rows.Next()) return absl::UnavailableError("it is no longer in the database");
  const MapPosition position{{rows.Int64(0), rows.Int64(1)}, rows.Int64(2)};
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return position;
}

std::string ApplicationNameOf(const std::string& server_id) {
  return absl::StrCat(kApplication, server_id);
}

absl::Status EndSessionsOfLostOwner(Connection* connection, const std::string& map) {
  return connection->Query(kEndSessions, map, kApplication).status();
}

absl::Status InsertMap(Connection* connection, const MapHeader& header, const std::string& owner,
                       int64_t last_write) {
  return connection
      ->Query(kInsertMap, header.name, header.frame_id, absl::ToUnixNanos(header.created_at),
              header.request_id, static_cast<int64_t>(header.incarnation), header.provisional,
              last_write, owner, header.unfinished_copy)
      .status();
}

absl::StatusOr<OwnedMap::Row> TakeMap(Connection* connection, const MapRow& row,
                                      const std::string& owner) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> epoch,
                            connection->QueryInt64(kTakeMap, row.id, owner));
  if (!epoch) return absl::DataLossError("the map is no longer in the database");
  return OwnedMap::Row{row.id, *epoch, row.last_write};
}

absl::StatusOr<std::vector<uint64_t>> RenewAllIncarnations(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kLockMaps));
  std::vector<int64_t> ids;
  while (rows.Next()) ids.push_back(rows.Int64(0));
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return Renew(connection, ids);
}

absl::StatusOr<std::optional<uint64_t>> RenewIncarnation(Connection* connection,
                                                         const std::string& name,
                                                         uint64_t incarnation, Revision shown) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<MapRow> row, FindMap(connection, name));
  if (!row || row->header.incarnation != incarnation || row->revision >= shown) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(const std::vector<uint64_t> renewed, Renew(connection, {row->id}));
  return renewed.front();
}

absl::StatusOr<Survey> ReadSurvey(Connection* connection) {
  Survey survey;
  HYPERMAP_ASSIGN_OR_RETURN(Rows servers, connection->Query(kServers));
  while (servers.Next()) {
    survey.servers.push_back({std::string(servers.Text(0)), std::string(servers.Text(1)),
                              absl::Microseconds(servers.Int64(2)), servers.Bool(3)});
  }
  HYPERMAP_RETURN_IF_ERROR(servers.row_status());
  HYPERMAP_ASSIGN_OR_RETURN(Rows maps, connection->Query(kMaps));
  while (maps.Next()) {
    survey.maps.push_back({std::string(maps.Text(0)), static_cast<uint64_t>(maps.Int64(1)),
                           maps.Int64(2), std::string(maps.Text(3))});
  }
  HYPERMAP_RETURN_IF_ERROR(maps.row_status());
  return survey;
}

absl::StatusOr<std::map<std::string, NewestRevision>> ReadNewestRevisions(
    Connection* connection, const std::vector<std::string>& names) {
  const std::vector<absl::string_view> views(names.begin(), names.end());
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kNewest, absl::MakeConstSpan(views)));
  std::map<std::string, NewestRevision> newest;
  while (rows.Next()) {
    newest[std::string(rows.Text(0))] = {static_cast<uint64_t>(rows.Int64(1)), rows.Int64(2)};
  }
  HYPERMAP_RETURN_IF_ERROR(rows.row_status());
  return newest;
}

absl::Status PublishCopy(Connection* connection, int64_t map, const std::string& name,
                         const std::string& owner) {
  return connection->Query(kPublishCopy, map, name, owner).status();
}

absl::Status RemoveHiddenCopies(Connection* connection, const std::string& server) {
  return connection->Query(kRemoveHiddenCopies, server).status();
}

absl::Status RemoveHidden(Connection* connection, const std::string& hidden) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<MapRow> found, FindMap(connection, hidden));
  return found ? RemoveName(connection, found->id) : absl::OkStatus();
}

std::string HiddenNameOf(const std::string& name) {
  return absl::StrCat(".", name, ".", absl::Hex(NewIncarnation()));
}

absl::Status RemoveName(Connection* connection, int64_t map) {
  return connection->Query(kRemoveName, map).status();
}

}  // namespace hypermap::storage::postgres
