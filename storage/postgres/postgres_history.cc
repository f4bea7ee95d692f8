#include "storage/postgres/postgres_history.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/postgres/change_log.h"
#include "storage/postgres/layer_versions.h"

namespace hypermap::storage::postgres {
namespace {

// The SQLSTATE of statements after one that failed, also because it was cancelled.
constexpr char kTransactionHasFailed[] = "25P02";

// The names of deleted maps are NULL, and their incarnations 0 once rows are removed. The last
// parameter tells whether deleted maps are read.
constexpr char kKept[] =
    "SELECT oldest_revision, revision FROM hypermap.maps "
    "WHERE id = $1 AND incarnation <> 0 AND (name IS NOT NULL OR $2)";

// Also bounds, for this transaction only, the time for which it may be left unused.
constexpr char kBeginPast[] = R"sql(
SELECT oldest_revision, revision, frame_id,
    set_config('idle_in_transaction_session_timeout', '60s', true)
  FROM hypermap.maps WHERE id = $1 AND incarnation <> 0 AND (name IS NOT NULL OR $2)
)sql";

// The times of revisions never decrease, so that a binary search needs no index. It has no result
// when a row is missing. Revision 0 has none, and was made with the map.
constexpr char kRevisionAt[] = R"sql(
WITH RECURSIVE map AS (
  SELECT oldest_revision, revision, coalesce(r.time_ns, CASE oldest_revision WHEN 0 THEN
      created_at_ns END) AS oldest_time_ns
    FROM hypermap.maps AS m LEFT JOIN LATERAL (
      SELECT time_ns FROM hypermap.revisions
        WHERE map = m.id AND revision = m.oldest_revision) AS r ON true
    WHERE m.id = $1 AND incarnation <> 0 AND (m.name IS NOT NULL OR $3)),
search AS (
  SELECT oldest_revision AS low, revision AS high FROM map
  UNION ALL
  SELECT CASE WHEN r.time_ns <= $2 THEN middle WHEN r.time_ns > $2 THEN low END,
      CASE WHEN r.time_ns <= $2 THEN high WHEN r.time_ns > $2 THEN middle - 1 END
    FROM search CROSS JOIN LATERAL (SELECT high - (high - low) / 2 AS middle) AS m
    LEFT JOIN LATERAL (
      SELECT time_ns FROM hypermap.revisions WHERE map = $1 AND revision = middle) AS r ON true
    WHERE low < high)
SELECT oldest_revision, oldest_time_ns, (SELECT low FROM search WHERE low = high) FROM map
)sql";

}  // namespace

absl::Status HistoryStatus(const std::string& map, const absl::Status& status) {
  if (status.ok() || absl::IsResourceExhausted(status)) return status;
  absl::StatusCode code = status.code();
  if (absl::IsFailedPrecondition(status) || SqlStateOf(status) == kTransactionHasFailed) {
    code = absl::StatusCode::kUnavailable;
  } else if (absl::IsInternal(status)) {
    code = absl::StatusCode::kDataLoss;
  }
  return absl::Status(code, absl::StrCat("map ", map, ": ", status.message()));
}

PostgresHistory::PostgresHistory(ConnectOptions options, int64_t map, std::string map_name,
                                 const CacheRoomPtr& cache_room, DeletedMaps deleted)
    : options_(std::move(options)),
      map_(map),
      map_name_(std::move(map_name)),
      reads_deleted_(deleted == DeletedMaps::kRead),
      objects_(map, cache_room),
      tiles_(map, cache_room),
      structures_(cache_room, kMaxStructureBytes) {}

absl::Status PostgresHistory::Deleted() const {
  return absl::UnavailableError("it is no longer in the database");
}

absl::Status PostgresHistory::WithConnection(absl::FunctionRef<absl::Status(Connection&)> use) {
  if (connection_ != nullptr) {
    absl::Status status = use(*connection_);
    if (!connection_->is_broken()) return status;
    // A PastMap may still refer to it.
    connection_.reset();
  }
  HYPERMAP_ASSIGN_OR_RETURN(connection_, Connection::Open(options_));
  return use(*connection_);
}

absl::StatusOr<PostgresHistory::Opened> PostgresHistory::Begin(
    absl::FunctionRef<void(Pipeline&)> ask) {
  std::optional<Opened> opened;
  const auto begin = [&](Connection& connection) -> absl::Status {
    Pipeline pipeline(&connection);
    pipeline.Add(Transaction::BeginStatement(Transaction::Kind::kSnapshot));
    pipeline.Ask(kBeginPast, map_, reads_deleted_);
    ask(pipeline);
    HYPERMAP_RETURN_IF_ERROR(pipeline.Finish());
    Transaction transaction = Transaction::Begun(&connection, Transaction::Kind::kSnapshot);
    std::deque<Rows> answers = pipeline.TakeRows();
    Rows rows = std::move(answers.front());
    answers.pop_front();
    if (!rows.Next()) return Deleted();
    const KeptRevisions kept{rows.Int64(0), rows.Int64(1)};
    std::string frame_id(rows.Text(2));
    HYPERMAP_RETURN_IF_ERROR(rows.row_status());
    opened.emplace(
        Opened{connection_, std::move(transaction), std::move(frame_id), kept, std::move(answers)});
    return absl::OkStatus();
  };
  if (const absl::Status status = WithConnection(begin); !status.ok()) return InMap(status);
  return *std::move(opened);
}

absl::StatusOr<KeptRevisions> PostgresHistory::Kept() {
  KeptRevisions kept;
  const absl::Status status = WithConnection([&](Connection& connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(kKept, map_, reads_deleted_));
    if (!rows.Next()) return Deleted();
    kept = {rows.Int64(0), rows.Int64(1)};
    return rows.row_status();
  });
  if (!status.ok()) return InMap(status);
  return kept;
}

absl::Status PostgresHistory::CheckKept(const KeptRevisions& kept, Revision revision) const {
  if (revision < kept.oldest) {
    return absl::OutOfRangeError(absl::StrCat("map ", map_name_, ": revision ", revision,
                                              " is not kept; the oldest is ", kept.oldest));
  }
  if (revision > kept.newest) {
    return absl::OutOfRangeError(absl::StrCat("map ", map_name_, ": there is no revision ",
                                              revision, " yet; the newest is ", kept.newest));
  }
  return absl::OkStatus();
}

absl::StatusOr<Revision> PostgresHistory::RevisionAt(absl::Time time) {
  Revision found = 0;
  const auto find = [&](Connection& connection) -> absl::Status {
    HYPERMAP_ASSIGN_OR_RETURN(
        Rows rows, connection.Query(kRevisionAt, map_, absl::ToUnixNanos(time), reads_deleted_));
    if (!rows.Next()) return Deleted();
    const Revision oldest = rows.Int64(0);
    const std::optional<int64_t> oldest_time = rows.OptionalInt64(1);
    const std::optional<int64_t> revision = rows.OptionalInt64(2);
    HYPERMAP_RETURN_IF_ERROR(rows.row_status());
    if (!oldest_time || !revision) {
      return absl::DataLossError(
          absl::StrCat("hypermap.revisions lacks one of those from revision ", oldest, " on"));
    }
    const absl::Time made = absl::FromUnixNanos(*oldest_time);
    if (made > time) {
      return absl::OutOfRangeError(
          absl::StrCat("the oldest kept revision ", oldest, " was made at ",
                       absl::FormatTime(absl::RFC3339_full, made, absl::UTCTimeZone())));
    }
    found = *revision;
    return absl::OkStatus();
  };
  if (const absl::Status status = WithConnection(find); !status.ok()) return InMap(status);
  return found;
}

void PostgresHistory::AskForStructureAt(Pipeline& pipeline, Revision revision) const {
  AskForLayersAt(pipeline, map_, revision);
  if (revision > frameless_until_) AskForFramesAt(pipeline, map_, revision);
}

absl::StatusOr<PastStructurePtr> PostgresHistory::ReadStructureAt(Revision revision,
                                                                  Opened* opened) {
  std::deque<Rows>& answers = opened->answers;
  MapStructure head;
  head.map_name = map_name_;
  head.frame_id = opened->frame_id;
  head.revision = revision;
  absl::StatusOr<PastStructurePtr> structure =
      ReadStructure(std::move(answers.at(0)), answers.size() > 1 ? std::move(answers[1]) : Rows(),
                    std::move(head));
  if (structure.ok()) {
    if ((*structure)->map->frames.transforms().empty()) {
      frameless_until_ = std::max(frameless_until_, revision);
    }
    structures_.Insert(revision, *structure,
                       1024 + UnsharedBytes(*(*structure)->map, MapStructure()));
  }
  return structure;
}

absl::StatusOr<std::unique_ptr<PastMap>> PostgresHistory::At(Revision revision) {
  const PastStructurePtr known = structures_.Find(revision);
  HYPERMAP_ASSIGN_OR_RETURN(Opened opened, Begin([&](Pipeline& pipeline) {
                              if (known == nullptr) AskForStructureAt(pipeline, revision);
                            }));
  HYPERMAP_RETURN_IF_ERROR(CheckKept(opened.kept, revision));
  absl::StatusOr<PastStructurePtr> structure =
      known != nullptr ? known : ReadStructureAt(revision, &opened);
  if (!structure.ok()) return InMap(structure.status());
  return std::make_unique<PostgresPastMap>(std::move(opened.connection),
                                           std::move(opened.transaction), &objects_, &tiles_,
                                           *std::move(structure));
}

absl::StatusOr<std::vector<RevisionRecord>> PostgresHistory::Revisions(Revision after,
                                                                       Revision before,
                                                                       bool newest_first,
                                                                       int max_count) {
  HYPERMAP_ASSIGN_OR_RETURN(const Opened opened, Begin());
  absl::StatusOr<std::vector<RevisionRecord>> records =
      ReadRevisions(*opened.connection, map_, std::max(after, opened.kept.oldest - 1), before,
                    newest_first, std::max(max_count, 0));
  if (!records.ok()) return InMap(records.status());
  return records;
}

absl::StatusOr<std::vector<PastCommit>> PostgresHistory::Commits(Revision after, int max_changes) {
  HYPERMAP_ASSIGN_OR_RETURN(const Opened opened, Begin());
  HYPERMAP_RETURN_IF_ERROR(CheckKept(opened.kept, after));
  absl::StatusOr<std::vector<PastCommit>> commits =
      ReadCommits(*opened.connection, map_, after, max_changes, &objects_, &tiles_);
  if (!commits.ok()) return InMap(commits.status());
  return commits;
}

}  // namespace hypermap::storage::postgres
