#include "storage/outbox/outbox_file.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/sqlite/durable_file.h"
#include "storage/sqlite/revision_witness.h"
#include "storage/sqlite/sqlite.h"

namespace hypermap::storage {
namespace {

constexpr int64_t kApplicationId = 0x486d4f62;  // "HmOb"
constexpr int64_t kVersion = 3;
// Only another program that looks into the file can hold it up.
constexpr absl::Duration kBusyTimeout = absl::Seconds(5);

constexpr char kSettings[] = R"sql(
PRAGMA journal_mode = WAL;
PRAGMA synchronous = FULL;
PRAGMA temp_store = MEMORY;
)sql";

// The tables of version 1. The column `code` of a request is the absl::StatusCode with which the
// server refused it; NULL if it was not refused.
constexpr char kSchema[] = R"sql(
CREATE TABLE streams (
  id INTEGER PRIMARY KEY,
  map TEXT NOT NULL,
  layer TEXT NOT NULL,
  robot TEXT NOT NULL,
  next_sequence INTEGER NOT NULL DEFAULT 0,
  UNIQUE (map, layer, robot)
);
CREATE TABLE letters (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  stream INTEGER NOT NULL REFERENCES streams (id),
  request_id TEXT NOT NULL,
  sequence INTEGER,
  options TEXT NOT NULL,
  body BLOB NOT NULL,
  put_at_ns INTEGER NOT NULL,
  first_sent_at_ns INTEGER,
  code INTEGER,
  message TEXT
);
CREATE INDEX letters_to_send ON letters (stream, id) WHERE code IS NULL;
CREATE TABLE counts (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  delivered INTEGER NOT NULL
);
INSERT INTO counts VALUES (1, 0);
)sql";

// The columns that version 2 added to tell the time since a request was first sent. In a request
// that version 1 sent, `sent_boot_id` is empty.
constexpr char kSendTimes[] = R"sql(
ALTER TABLE letters ADD COLUMN sent_synchronized INTEGER NOT NULL DEFAULT 0;
ALTER TABLE letters ADD COLUMN sent_boot_id TEXT NOT NULL DEFAULT '';
ALTER TABLE letters ADD COLUMN sent_since_boot_ns INTEGER NOT NULL DEFAULT 0;
)sql";

// The columns that version 3 added for the witness of the file (storage/sqlite/revision_witness.h):
// a random number that tells this file from others, and the number of its commits.
constexpr char kCommits[] = R"sql(
ALTER TABLE counts ADD COLUMN incarnation INTEGER NOT NULL DEFAULT 0;
ALTER TABLE counts ADD COLUMN commits INTEGER NOT NULL DEFAULT 0;
UPDATE counts SET incarnation = random() | 1;
)sql";

constexpr char kRequestColumns[] =
    "letters.id, stream, request_id, sequence, options, body, put_at_ns, first_sent_at_ns, "
    "sent_synchronized, sent_boot_id, sent_since_boot_ns";
constexpr int kNumRequestColumns = 11;

absl::Time TimeAt(int64_t ns) { return absl::FromUnixNanos(ns); }

// Reads a request from a row that begins with kRequestColumns.
QueuedRequest ReadQueuedRequest(Statement& row) {
  QueuedRequest request;
  request.id = row.Int64(0);
  request.stream = row.Int64(1);
  request.request_id = std::string(row.Text(2));
  request.sequence = row.OptionalInt64(3);
  request.options = std::string(row.Text(4));
  request.body = std::string(row.Blob(5));
  request.put_at = TimeAt(row.Int64(6));
  if (const std::optional<int64_t> ns = row.OptionalInt64(7)) {
    request.first_sent = {TimeAt(*ns), row.Int64(8) != 0, std::string(row.Text(9)),
                          absl::Nanoseconds(row.Int64(10))};
  }
  return request;
}

// All rows of a statement, each made a value by `read`.
template <typename Read>
auto ReadAll(absl::StatusOr<Statement> statement, Read read)
    -> absl::StatusOr<std::vector<decltype(read(*statement))>> {
  HYPERMAP_RETURN_IF_ERROR(statement.status());
  std::vector<decltype(read(*statement))> all;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, statement->Step());
    if (!has_row) return all;
    all.push_back(read(*statement));
    HYPERMAP_RETURN_IF_ERROR(statement->row_status());
  }
}

absl::StatusOr<int64_t> Pragma(Database& database, const char* name) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::optional<int64_t> value,
                            database.QueryInt64(absl::StrCat("PRAGMA ", name)));
  return value.value_or(0);
}

// Brings an empty file (version 0), or one of an earlier version, to this version.
absl::Status Upgrade(Database& database, int64_t version) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(&database));
  if (version < 1) {
    HYPERMAP_RETURN_IF_ERROR(
        database.Execute(absl::StrCat(kSchema, "PRAGMA application_id = ", kApplicationId, ";")));
  }
  if (version < 2) HYPERMAP_RETURN_IF_ERROR(database.Execute(kSendTimes));
  HYPERMAP_RETURN_IF_ERROR(
      database.Execute(absl::StrCat(kCommits, "PRAGMA user_version = ", kVersion, ";")));
  return transaction.Commit();
}

// Makes sure that the file is an outbox of this version. An empty file becomes one, unless
// `is_witnessed`, and so does one of an earlier version.
absl::Status Prepare(Database& database, bool is_witnessed) {
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t application, Pragma(database, "application_id"));
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t version, Pragma(database, "user_version"));
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t tables, Pragma(database, "schema_version"));
  const bool is_new = tables == 0;
  if (is_new && is_witnessed) {
    return absl::DataLossError("the file is empty, and had changes: its log was damaged");
  }
  if (!is_new && application != kApplicationId) {
    return absl::FailedPreconditionError("the file is not an outbox");
  }
  if (!is_new && (version < 1 || version > kVersion)) {
    return absl::FailedPreconditionError(
        absl::StrCat("the outbox is of version ", version, ", and this program knows ", kVersion));
  }
  absl::Status status = database.Execute(kSettings);
  if (status.ok() && version < kVersion) status = Upgrade(database, is_new ? 0 : version);
  return status;
}

// The size of the content: pages of removed rows do not count, as they are used again.
absl::StatusOr<int64_t> UsedBytes(Database& database) {
  int64_t values[3];
  const char* const names[] = {"page_count", "freelist_count", "page_size"};
  for (int i = 0; i < 3; ++i) {
    HYPERMAP_ASSIGN_OR_RETURN(const int64_t value, Pragma(database, names[i]));
    values[i] = value;
  }
  return (values[0] - values[1]) * values[2];
}

absl::StatusOr<RevisionWitness> WitnessOf(Database& database) {
  HYPERMAP_ASSIGN_OR_RETURN(const auto incarnation,
                            database.QueryInt64("SELECT incarnation FROM counts"));
  HYPERMAP_ASSIGN_OR_RETURN(const auto commits, database.QueryInt64("SELECT commits FROM counts"));
  if (!incarnation || !commits) return absl::DataLossError("the outbox has lost its counts");
  return RevisionWitness{static_cast<uint64_t>(*incarnation), *commits, 0, false};
}

// DATA_LOSS if the file lacks commits that the witness has seen.
absl::Status CheckIsWhole(Database& database, const std::optional<RevisionWitness>& seen) {
  HYPERMAP_ASSIGN_OR_RETURN(const RevisionWitness has, WitnessOf(database));
  if (!seen || seen->incarnation != has.incarnation || seen->revision <= has.revision) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat(
      "the newest ", seen->revision - has.revision, " of ", seen->revision,
      " changes are missing: the log of the file was damaged, or an older copy took its place"));
}

// If this fails, the witness stays older than the file: a loss may go unnoticed.
void KeepWitness(Database& database, FileLock& lock) {
  const absl::StatusOr<RevisionWitness> witness = WitnessOf(database);
  if (witness.ok()) lock.Write(EncodeWitness(*witness)).IgnoreError();
}

absl::Status Named(const std::string& path, const absl::Status& status) {
  return {status.code(), absl::StrCat("outbox ", path, ": ", status.message())};
}

}  // namespace

absl::StatusOr<std::unique_ptr<OutboxFile>> OutboxFile::Open(const std::string& path,
                                                             int64_t max_bytes, bool accept_loss) {
  HYPERMAP_ASSIGN_OR_RETURN(FileLock lock, FileLock::Acquire(path + ".lock"));
  HYPERMAP_ASSIGN_OR_RETURN(const bool exists, FindPath(path));
  // A witness of a file that somebody removed would be one against the next file.
  if (!exists) HYPERMAP_RETURN_IF_ERROR(lock.Write(std::string(EncodeWitness({}).size(), '\0')));
  const auto witness = ReadWitness(lock);
  if (!witness.ok()) return Named(path, witness.status());
  absl::StatusOr<std::unique_ptr<Database>> database =
      Database::Open(path, Database::OpenMode::kCreate, kBusyTimeout);
  if (!database.ok()) return Named(path, database.status());
  absl::Status status = Prepare(**database, !accept_loss && witness->has_value());
  if (status.ok() && !accept_loss) status = CheckIsWhole(**database, *witness);
  if (!status.ok()) return Named(path, status);
  KeepWitness(**database, lock);
  return std::unique_ptr<OutboxFile>(
      new OutboxFile(std::move(lock), *std::move(database), max_bytes));
}

OutboxFile::OutboxFile(FileLock lock, std::unique_ptr<Database> database, int64_t max_bytes)
    : lock_(std::move(lock)), database_(std::move(database)), max_bytes_(max_bytes) {}

OutboxFile::~OutboxFile() = default;

absl::StatusOr<OutboxStream> OutboxFile::FindStream(const std::string& map,
                                                    const std::string& layer,
                                                    const std::string& robot) {
  const auto find = [&] {
    return database_->QueryInt64("SELECT id FROM streams WHERE map = ? AND layer = ? AND robot = ?",
                                 map, layer, robot);
  };
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<int64_t> id, find());
  if (!id) {
    HYPERMAP_RETURN_IF_ERROR(Change([&] {
      return database_->Run("INSERT INTO streams (map, layer, robot) VALUES (?, ?, ?)", map, layer,
                            robot);
    }));
    HYPERMAP_ASSIGN_OR_RETURN(id, find());
  }
  return OutboxStream{*id, map, layer, robot};
}

absl::StatusOr<std::vector<OutboxStream>> OutboxFile::Streams() {
  return ReadAll(
      database_->Prepare("SELECT id, map, layer, robot FROM streams WHERE EXISTS (SELECT "
                         "1 FROM letters WHERE stream = streams.id AND code IS NULL)"),
      [](Statement& row) {
        return OutboxStream{row.Int64(0), std::string(row.Text(1)), std::string(row.Text(2)),
                            std::string(row.Text(3))};
      });
}

absl::StatusOr<int64_t> OutboxFile::Put(const QueuedRequest& request) {
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t used, UsedBytes(*database_));
  if (used + static_cast<int64_t>(request.body.size()) > max_bytes_) {
    return absl::ResourceExhaustedError(
        absl::StrCat("the outbox is full: it may have ", max_bytes_, " bytes and uses ", used));
  }
  HYPERMAP_RETURN_IF_ERROR(Change([&] {
    return database_->Run(
        "INSERT INTO letters (stream, request_id, options, body, put_at_ns) VALUES (?, ?, ?, ?, ?)",
        request.stream, request.request_id, request.options, BlobView{request.body},
        absl::ToUnixNanos(request.put_at));
  }));
  return sqlite3_last_insert_rowid(database_->handle());
}

absl::StatusOr<std::vector<QueuedRequest>> OutboxFile::First(int64_t stream, int limit) {
  absl::StatusOr<Statement> select = database_->Prepare(
      absl::StrCat("SELECT ", kRequestColumns,
                   " FROM letters WHERE stream = ? AND code IS NULL ORDER BY letters.id LIMIT ?"));
  if (select.ok()) select->Bind(stream, limit);
  return ReadAll(std::move(select), ReadQueuedRequest);
}

absl::Status OutboxFile::MarkSent(absl::Span<QueuedRequest> requests, const SendTime& now) {
  return Change([&] { return WriteSent(requests, now); });
}

absl::Status OutboxFile::MarkSentInSequence(absl::Span<QueuedRequest> requests, int64_t unused,
                                            const SendTime& now) {
  if (requests.empty()) return absl::OkStatus();
  return Change([&]() -> absl::Status {
    const int64_t stream = requests.front().stream;
    HYPERMAP_ASSIGN_OR_RETURN(
        const std::optional<int64_t> next,
        database_->QueryInt64("SELECT next_sequence FROM streams WHERE id = ?", stream));
    int64_t sequence = std::max(next.value_or(0), unused);
    for (QueuedRequest& request : requests) {
      if (!request.sequence) request.sequence = sequence++;
    }
    HYPERMAP_RETURN_IF_ERROR(
        database_->Run("UPDATE streams SET next_sequence = ? WHERE id = ?", sequence, stream));
    return WriteSent(requests, now);
  });
}

absl::Status OutboxFile::Change(absl::FunctionRef<absl::Status()> change) {
  HYPERMAP_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database_.get()));
  HYPERMAP_RETURN_IF_ERROR(change());
  HYPERMAP_RETURN_IF_ERROR(database_->Run("UPDATE counts SET commits = commits + 1"));
  HYPERMAP_RETURN_IF_ERROR(transaction.Commit());
  KeepWitness(*database_, lock_);
  return absl::OkStatus();
}

absl::Status OutboxFile::WriteSent(absl::Span<QueuedRequest> requests, const SendTime& now) {
  for (QueuedRequest& request : requests) {
    if (request.first_sent) continue;
    request.first_sent = now;
    HYPERMAP_RETURN_IF_ERROR(database_->Run(
        "UPDATE letters SET sequence = ?, first_sent_at_ns = ?, sent_synchronized = ?, "
        "sent_boot_id = ?, sent_since_boot_ns = ? WHERE id = ?",
        request.sequence, absl::ToUnixNanos(now.wall), int64_t{now.synchronized}, now.boot_id,
        absl::ToInt64Nanoseconds(now.since_boot), request.id));
  }
  return absl::OkStatus();
}

absl::Status OutboxFile::Settle(absl::Span<const int64_t> delivered,
                                absl::Span<const ServerRefusal> refused) {
  return Change([&]() -> absl::Status {
    for (const int64_t request : delivered) {
      HYPERMAP_RETURN_IF_ERROR(database_->Run("DELETE FROM letters WHERE id = ?", request));
    }
    for (const ServerRefusal& refusal : refused) {
      HYPERMAP_RETURN_IF_ERROR(database_->Run(
          "UPDATE letters SET code = ?, message = ? WHERE id = ?", refusal.why.raw_code(),
          absl::string_view(refusal.why.message()), refusal.request));
    }
    return database_->Run("UPDATE counts SET delivered = delivered + ?",
                          static_cast<int64_t>(delivered.size()));
  });
}

absl::StatusOr<std::vector<RefusedRequest>> OutboxFile::Refused() {
  constexpr int kFirst = kNumRequestColumns;
  return ReadAll(database_->Prepare(
                     absl::StrCat("SELECT ", kRequestColumns,
                                  ", map, layer, robot, code, message FROM letters JOIN streams "
                                  "ON streams.id = stream WHERE code IS NOT NULL ORDER BY 1")),
                 [](Statement& row) {
                   RefusedRequest refused;
                   refused.request = ReadQueuedRequest(row);
                   refused.stream = {refused.request.stream, std::string(row.Text(kFirst)),
                                     std::string(row.Text(kFirst + 1)),
                                     std::string(row.Text(kFirst + 2))};
                   refused.why = absl::Status(static_cast<absl::StatusCode>(row.Int64(kFirst + 3)),
                                              row.Text(kFirst + 4));
                   return refused;
                 });
}

absl::Status OutboxFile::PutBack(int64_t request) {
  // The request counts as never sent: the time of its first sending is set when it is sent again.
  return ChangeRefused(
      "UPDATE letters SET code = NULL, message = NULL, first_sent_at_ns = NULL "
      "WHERE id = ? AND code IS NOT NULL",
      request);
}

absl::Status OutboxFile::Discard(int64_t request) {
  return ChangeRefused("DELETE FROM letters WHERE id = ? AND code IS NOT NULL", request);
}

absl::Status OutboxFile::ChangeRefused(const std::string& sql, int64_t request) {
  return Change([&]() -> absl::Status {
    HYPERMAP_RETURN_IF_ERROR(database_->Run(sql, request));
    if (database_->changed_rows() == 1) return absl::OkStatus();
    return absl::NotFoundError(absl::StrCat("nothing that was refused has the number ", request));
  });
}

absl::StatusOr<OutboxCounts> OutboxFile::Counts() {
  absl::StatusOr<std::vector<OutboxCounts>> counts = ReadAll(
      database_->Prepare("SELECT (SELECT count(*) FROM letters WHERE code IS NULL), delivered, "
                         "(SELECT count(*) FROM letters WHERE code IS NOT NULL) FROM counts"),
      [](Statement& row) {
        return OutboxCounts{row.Int64(0), row.Int64(1), row.Int64(2)};
      });
  HYPERMAP_RETURN_IF_ERROR(counts.status());
  if (counts->size() != 1) return absl::DataLossError("the outbox has lost its counts");
  return counts->front();
}

}  // namespace hypermap::storage
