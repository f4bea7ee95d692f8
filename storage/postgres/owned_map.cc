#include "storage/postgres/owned_map.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "storage/incarnation.h"
#include "storage/ownership.h"

namespace hypermap::storage::postgres {
namespace {

// Divides by zero if the map is not in the expected state, which ends the transaction.
constexpr char kWrite[] = R"sql(
WITH written AS (
  UPDATE hypermap.maps SET last_write = $4 WHERE id = $1 AND epoch = $2 AND last_write = $3
    RETURNING 1)
SELECT 1 / count(*) FROM written
)sql";
constexpr char kAdvance[] = R"sql(
WITH written AS (
  UPDATE hypermap.maps SET last_write = $4, revision = $6, next_object_id = $7, next_lineage = $8,
      provisional = false
    WHERE id = $1 AND epoch = $2 AND last_write = $3 AND revision = $5
    RETURNING 1)
SELECT 1 / count(*) FROM written
)sql";
constexpr char kDivisionByZero[] = "22012";

// Waits for a transaction of an earlier session that still holds the row.
constexpr char kAskRow[] = "SELECT epoch, last_write FROM hypermap.maps WHERE id = $1 FOR UPDATE";
constexpr char kFence[] = "UPDATE hypermap.maps SET last_write = $2 WHERE id = $1";

constexpr char kOwns[] = "SELECT 1::bigint FROM hypermap.maps WHERE id = $1 AND epoch = $2";
constexpr char kRelease[] = "UPDATE hypermap.maps SET owner = NULL WHERE id = $1 AND epoch = $2";

// While a copy is written elsewhere nothing is read for a while, for which the transaction may be
// left unused. The first read also takes its snapshot.
constexpr char kWaitLonger[] =
    "SELECT set_config('idle_in_transaction_session_timeout', '1h', true)";

constexpr absl::Duration kAskPause = absl::Milliseconds(100);

int64_t NewNumber() { return static_cast<int64_t>(NewIncarnation()); }

}  // namespace

OwnedMap::OwnedMap(ConnectOptions options, const Row& row)
    : options_(std::move(options)), row_(row) {}

std::unique_ptr<OwnedMap> OwnedMap::OfAnother(ConnectOptions options, int64_t map) {
  auto of_another = std::make_unique<OwnedMap>(std::move(options), Row{map, 0, 0});
  of_another->lost_ = absl::FailedPreconditionError("the map is open for reading only");
  return of_another;
}

std::unique_ptr<OwnedMap> OwnedMap::AtOneMoment(ConnectOptions options, int64_t map) {
  auto pinned = OfAnother(std::move(options), map);
  pinned->is_of_one_moment_ = true;
  return pinned;
}

absl::StatusOr<Connection*> OwnedMap::ConnectionOfMoment() {
  if (connection_ == nullptr) {
    HYPERMAP_ASSIGN_OR_RETURN(connection_, Connection::Open(options_));
    HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction,
                              Transaction::Begin(connection_.get(), Transaction::Kind::kSnapshot));
    HYPERMAP_RETURN_IF_ERROR(connection_->Query(kWaitLonger).status());
    moment_.emplace(std::move(transaction));
  }
  if (!connection_->is_broken()) return connection_.get();
  return absl::UnavailableError("the connection in which the map was read as of one moment broke");
}

absl::StatusOr<Connection*> OwnedMap::connection() {
  if (is_of_one_moment_) return ConnectionOfMoment();
  if (connection_ == nullptr || connection_->is_broken()) {
    connection_.reset();
    HYPERMAP_ASSIGN_OR_RETURN(connection_, Connection::Open(options_));
  }
  return connection_.get();
}

absl::Status OwnedMap::Write(absl::FunctionRef<absl::Status(Pipeline&)> add,
                             const std::optional<Advance>& advance) {
  HYPERMAP_RETURN_IF_ERROR(lost_);
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, this->connection());
  const int64_t written = NewNumber();
  absl::Status status;
  {
    Pipeline pipeline(connection);
    pipeline.Add("BEGIN");
    if (advance) {
      pipeline.Add(kAdvance, row_.map, row_.epoch, row_.last_write, written, advance->from,
                   advance->to, advance->next_object_id, advance->next_lineage);
    } else {
      pipeline.Add(kWrite, row_.map, row_.epoch, row_.last_write, written);
    }
    const absl::Status added = add(pipeline);
    pipeline.Add(added.ok() ? "COMMIT" : "ROLLBACK");
    status = pipeline.Finish();
    if (!added.ok()) status = added;
  }
  return Settle(status, written);
}

absl::Status OwnedMap::WriteInSteps(absl::FunctionRef<absl::Status(Connection&)> run) {
  HYPERMAP_RETURN_IF_ERROR(lost_);
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, this->connection());
  const int64_t written = NewNumber();
  const auto write = [&]() -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(connection));
    HYPERMAP_RETURN_IF_ERROR(
        connection->Query(kWrite, row_.map, row_.epoch, row_.last_write, written).status());
    HYPERMAP_RETURN_IF_ERROR(run(*connection));
    return transaction.Commit();
  };
  return Settle(write(), written);
}

absl::Status OwnedMap::Confirm() {
  HYPERMAP_RETURN_IF_ERROR(lost_);
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, this->connection());
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> owned,
                            connection->QueryInt64(kOwns, row_.map, row_.epoch));
  if (owned) return absl::OkStatus();
  return Lose(Refusal(absl::UnavailableError("the owner of the map has changed meanwhile")));
}

void OwnedMap::Release() {
  if (!lost_.ok() || connection_ == nullptr || connection_->is_broken()) return;
  connection_->Query(kRelease, row_.map, row_.epoch).status().IgnoreError();
}

absl::Status OwnedMap::Settle(const absl::Status& status, int64_t written) {
  if (status.ok()) {
    row_.last_write = written;
    return absl::OkStatus();
  }
  if (connection_->is_broken()) return Resolve(status, written);
  if (connection_->is_in_transaction()) connection_->Execute("ROLLBACK").IgnoreError();
  if (SqlStateOf(status) == kDivisionByZero) return Lose(Refusal(status));
  return status;
}

absl::Status OwnedMap::Resolve(const absl::Status& status, int64_t written) {
  // The outcome has to be known, even if nobody waits for it any more.
  const ScopedCancellation here(nullptr);
  const absl::Time deadline = absl::Now() + kTimeToSettle;
  while (true) {
    const absl::StatusOr<Outcome> outcome = AskRow(written);
    if (outcome.ok()) return *outcome == Outcome::kStored ? absl::OkStatus() : status;
    if (!lost_.ok()) return lost_;
    if (absl::Now() > deadline) {
      // Whoever opens the map next finds out, and has the receipts for who asks again.
      return Lose(LostOwnershipError(
          absl::StrCat("it is not known whether the last changes are stored, because the database "
                       "does not answer: ",
                       outcome.status().message())));
    }
    absl::SleepFor(kAskPause);
  }
}

absl::StatusOr<OwnedMap::Outcome> OwnedMap::AskRow(int64_t written) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, this->connection());
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(connection));
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection->Query(kAskRow, row_.map));
  const bool found = rows.Next();
  const int64_t epoch = found ? rows.Int64(0) : 0;
  const int64_t last_write = found ? rows.Int64(1) : 0;
  if (!found || epoch != row_.epoch) {
    return Lose(LostOwnershipError(
        "another server owns the map by now, and it is not known whether the last changes are "
        "stored"));
  }
  if (last_write == written) {
    row_.last_write = written;
    return Outcome::kStored;
  }
  // The session that broke may not have read the transaction yet. With another number in the row it
  // can't commit it.
  const int64_t fence = NewNumber();
  HYPERMAP_RETURN_IF_ERROR(connection->Query(kFence, row_.map, fence).status());
  HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  row_.last_write = fence;
  return Outcome::kNotStored;
}

absl::Status OwnedMap::Refusal(const absl::Status& status) {
  absl::StatusOr<Rows> rows = connection_->Query(
      "SELECT epoch, last_write, owner FROM hypermap.maps WHERE id = $1", row_.map);
  HYPERMAP_RETURN_IF_ERROR(rows.status());
  if (!rows->Next()) return absl::DataLossError("the map is no longer in the database");
  if (rows->Int64(0) != row_.epoch) {
    return LostOwnershipError(
        absl::StrCat("server ", rows->IsNull(2) ? "" : rows->Text(2), " owns the map by now"));
  }
  // Another statement of the transaction has divided by zero.
  if (rows->Int64(1) == row_.last_write) return status;
  return absl::DataLossError("another program has changed the row of the map");
}

absl::Status OwnedMap::Lose(const absl::Status& reason) {
  if (absl::IsDataLoss(reason)) lost_ = reason;
  return reason;
}

}  // namespace hypermap::storage::postgres
