#include "storage/geopackage/deletion_log.h"

#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

constexpr char kCreateDeletionTable[] = R"sql(
PRAGMA synchronous = FULL;
CREATE TABLE IF NOT EXISTS deletions (
  id INTEGER PRIMARY KEY,
  request_id TEXT UNIQUE,
  map_name TEXT NOT NULL,
  finished INTEGER NOT NULL DEFAULT 0
);
)sql";

}  // namespace

absl::StatusOr<std::unique_ptr<DeletionLog>> DeletionLog::Open(const std::string& path,
                                                               absl::Duration busy_timeout) {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Database> database,
                            Database::Open(path, Database::OpenMode::kCreate, busy_timeout));
  HYPERMAP_RETURN_IF_ERROR(database->Execute(kCreateDeletionTable));
  return std::unique_ptr<DeletionLog>(new DeletionLog(std::move(database)));
}

absl::StatusOr<int64_t> DeletionLog::Begin(const std::string& request_id, const std::string& map) {
  const auto id = request_id.empty() ? std::nullopt : std::make_optional(request_id);
  // The request may have an unfinished deletion, which could be neither carried out nor cancelled.
  // It is begun again.
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement insert,
      database_->Prepare(
          "INSERT INTO deletions (request_id, map_name) VALUES (?, ?) ON CONFLICT (request_id) "
          "DO UPDATE SET map_name = excluded.map_name, finished = 0 RETURNING id"));
  HYPERMAP_RETURN_IF_ERROR(insert.Bind(id, map).Step().status());
  const int64_t deletion = insert.Int64(0);
  // The row comes before the statement is committed, which may fail.
  HYPERMAP_RETURN_IF_ERROR(insert.Run());
  return deletion;
}

absl::Status DeletionLog::Finish(int64_t deletion) {
  return database_->Run("UPDATE deletions SET finished = 1 WHERE id = ?", deletion);
}

absl::Status DeletionLog::Cancel(int64_t deletion) {
  return database_->Run("DELETE FROM deletions WHERE id = ?", deletion);
}

absl::StatusOr<std::optional<std::string>> DeletionLog::Find(const std::string& request_id) {
  if (request_id.empty()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare("SELECT map_name FROM deletions WHERE request_id = ? AND finished = 1"));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(request_id).Step());
  if (!has_row) return std::nullopt;
  std::string map(select.Text(0));
  HYPERMAP_RETURN_IF_ERROR(select.row_status());
  return map;
}

absl::StatusOr<std::vector<DeletionLog::Pending>> DeletionLog::FindPending() {
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database_->Prepare("SELECT id, map_name FROM deletions WHERE finished = 0 ORDER BY id"));
  std::vector<Pending> pending;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return pending;
    pending.push_back({select.Int64(0), std::string(select.Text(1))});
    HYPERMAP_RETURN_IF_ERROR(select.row_status());
  }
}

}  // namespace hypermap::storage
