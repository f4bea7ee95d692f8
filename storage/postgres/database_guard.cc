#include "storage/postgres/database_guard.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "storage/postgres/durability.h"
#include "storage/postgres/map_row.h"

namespace hypermap::storage::postgres {
namespace {

// Where the database is now. The name of a file of WAL begins with its timeline, which is up to
// date from the moment of a promotion on; pg_control_checkpoint() tells it after the next
// checkpoint.
constexpr char kPlaceNow[] = R"sql((
  SELECT c.system_identifier || '/' || d.oid || '/' || 'hypermap.place'::regclass::oid AS tables,
      ('x' || left(pg_walfile_name(pg_current_wal_lsn()), 8))::bit(32)::bigint AS timeline
    FROM pg_control_system() AS c, pg_database AS d WHERE d.datname = current_database()) AS n
)sql";
constexpr char kLookAtPlace[] =
    "SELECT p.tables, p.timeline, n.tables, n.timeline FROM hypermap.place AS p CROSS JOIN ";
constexpr char kInsertPlace[] =
    "INSERT INTO hypermap.place (id, tables, timeline) SELECT 1, n.tables, n.timeline FROM ";
constexpr char kOrReplacePlace[] =
    "ON CONFLICT (id) DO UPDATE SET tables = excluded.tables, timeline = excluded.timeline";

// Servers accept another place one after the other.
constexpr char kLockPlace[] = "SELECT id FROM hypermap.place FOR UPDATE";

// Leases end while the database is away.
constexpr char kMayOthersLive[] =
    "SELECT count(*) FROM hypermap.servers "
    "WHERE id <> $1 AND lease_until > clock_timestamp() - interval '1 minute'";
// A server that lives finds the database again within some seconds.
constexpr absl::Duration kTimeForOthers = absl::Seconds(10);
constexpr absl::Duration kOthersPause = absl::Milliseconds(100);

std::string DescribeChange(const DatabasePlace& written, const DatabasePlace& now) {
  if (written.tables != now.tables) {
    return "the database was restored from a copy, or upgraded with pg_upgrade";
  }
  return absl::StrCat("the database went from timeline ", written.timeline, " to ", now.timeline,
                      ", and no server knows that it has lost nothing");
}

}  // namespace

absl::Status RecordPlace(Connection* connection) {
  return connection->Query(absl::StrCat(kInsertPlace, kPlaceNow, kOrReplacePlace)).status();
}

absl::StatusOr<DatabaseGuard::Look> DatabaseGuard::LookAt(Connection* connection) {
  absl::StatusOr<Rows> rows = connection->Query(absl::StrCat(kLookAtPlace, kPlaceNow));
  if (absl::IsInternal(rows.status())) {
    // A standby that is not promoted yet can't tell.
    return absl::UnavailableError(
        absl::StrCat("the database does not tell its timeline: ", rows.status().message()));
  }
  HYPERMAP_RETURN_IF_ERROR(rows.status());
  if (!rows->Next()) return absl::DataLossError("hypermap.place has no row");
  Look look{{std::string(rows->Text(0)), rows->Int64(1)},
            {std::string(rows->Text(2)), rows->Int64(3)}};
  HYPERMAP_RETURN_IF_ERROR(rows->row_status());
  return look;
}

absl::Status DatabaseGuard::Begin(Connection* connection) {
  const Deadline deadline(kTimeForOthers);
  while (!deadline.has_passed()) {
    HYPERMAP_ASSIGN_OR_RETURN(const Look look, LookAt(connection));
    // Nobody vouches for other tables.
    if (look.written == look.now || look.written.tables != look.now.tables) break;
    HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> others,
                              connection->QueryInt64(kMayOthersLive, server_id_));
    if (others.value_or(0) == 0) break;
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::SleepFor(kOthersPause);
  }
  return Check(connection);
}

absl::Status DatabaseGuard::Check(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(const Look look, LookAt(connection));
  HYPERMAP_ASSIGN_OR_RETURN(const bool are_confirmed, AreCommitsConfirmed(connection));
  const MutexLock lock(&mutex_);
  if (look.written != look.now || accepted_ != look.now) {
    HYPERMAP_RETURN_IF_ERROR(Accept(connection));
  }
  are_confirmed_ = are_confirmed;
  return absl::OkStatus();
}

absl::Status DatabaseGuard::Accept(Connection* connection) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(connection));
  HYPERMAP_RETURN_IF_ERROR(connection->Query(kLockPlace).status());
  HYPERMAP_ASSIGN_OR_RETURN(const Look look, LookAt(connection));
  std::vector<uint64_t> renewed;
  // Otherwise another server has accepted the place.
  if (look.written != look.now) {
    if (!Vouches(look)) {
      HYPERMAP_ASSIGN_OR_RETURN(renewed, RenewAllIncarnations(connection));
    }
    HYPERMAP_RETURN_IF_ERROR(RecordPlace(connection));
  }
  HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  accepted_ = look.now;
  for (const uint64_t incarnation : renewed) {
    AddNote(incarnation, DescribeChange(look.written, look.now));
  }
  return absl::OkStatus();
}

bool DatabaseGuard::Vouches(const Look& look) const {
  return accepted_ == look.written && look.written.tables == look.now.tables && are_confirmed_;
}

void DatabaseGuard::AddNote(uint64_t incarnation, const std::string& reason) {
  const MutexLock lock(&notes_mutex_);
  notes_[incarnation] = absl::StrCat("it is another incarnation: ", reason);
}

std::optional<std::string> DatabaseGuard::TakeNote(uint64_t incarnation) {
  const MutexLock lock(&notes_mutex_);
  auto note = notes_.extract(incarnation);
  if (note.empty()) return std::nullopt;
  return std::move(note.mapped());
}

}  // namespace hypermap::storage::postgres
