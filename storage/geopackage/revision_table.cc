#include "storage/geopackage/revision_table.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/encoding/object_id_list.h"

namespace hypermap::storage {
namespace {

absl::StatusOr<TimedReceipt> ReceiptAt(Statement* row) {
  TimedReceipt timed;
  timed.receipt.request_id = std::string(row->Text(0));
  timed.receipt.revision = row->Int64(1);
  const absl::string_view bytes = row->Blob(2);
  if (!row->IsNull(3)) timed.receipt.request_digest = std::string(row->Blob(3));
  timed.time = absl::FromUnixNanos(row->Int64(4));
  absl::StatusOr<std::vector<ObjectId>> ids = std::vector<ObjectId>();
  if (row->row_status().ok()) ids = DecodeObjectIds(bytes);
  const absl::Status& status = row->row_status().ok() ? ids.status() : row->row_status();
  if (!status.ok()) {
    return absl::DataLossError(absl::StrCat("hypermap_receipts, request_id ",
                                            timed.receipt.request_id, ": ", status.message()));
  }
  timed.receipt.object_ids = *std::move(ids);
  return timed;
}

// The row after which those of `after` follow. Rows are added in the order of their revisions, and
// so are their ids.
absl::StatusOr<int64_t> IdOfReceipt(Database* database, absl::string_view request_id) {
  if (request_id.empty()) return 0;
  HYPERMAP_ASSIGN_OR_RETURN(
      const std::optional<int64_t> id,
      database->QueryInt64("SELECT id FROM hypermap_receipts WHERE request_id = ?", request_id));
  if (id) return *id;
  return absl::UnavailableError(
      absl::StrCat("the receipt of request_id ", request_id, " was removed meanwhile"));
}

}  // namespace

absl::Status InsertRevision(Database* database, const Commit& commit) {
  const Revision revision = commit.applied.snapshot->revision;
  absl::Status status = database->Run(
      "INSERT INTO hypermap_revisions (revision, time_ns, author, num_changes) "
      "VALUES (?, ?, ?, ?)",
      revision, absl::ToUnixNanos(commit.time), commit.author,
      commit.num_changes.value_or(static_cast<int64_t>(commit.applied.changes.size())));
  if (!status.ok() || commit.request_id.empty()) return status;
  return InsertReceipt(
      database, {{commit.request_id, revision, commit.applied.object_ids, commit.request_digest},
                 commit.time});
}

absl::Status InsertReceipt(Database* database, const TimedReceipt& timed) {
  const Receipt& receipt = timed.receipt;
  const std::string object_ids = EncodeObjectIds(receipt.object_ids);
  absl::Status status = database->Run(
      "INSERT OR IGNORE INTO hypermap_receipts (request_id, revision, time_ns, object_ids, digest) "
      "VALUES (?, ?, ?, ?, ?)",
      receipt.request_id, receipt.revision, absl::ToUnixNanos(timed.time), BlobView{object_ids},
      BlobView{receipt.request_digest});
  if (status.ok() && database->changed_rows() == 0) {
    return absl::AlreadyExistsError(
        absl::StrCat("request_id ", receipt.request_id, " was answered before"));
  }
  return status;
}

absl::StatusOr<std::vector<TimedReceipt>> ReadReceipts(Database* database, absl::string_view after,
                                                       int max_count) {
  HYPERMAP_ASSIGN_OR_RETURN(const int64_t after_id, IdOfReceipt(database, after));
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare("SELECT request_id, revision, object_ids, digest, time_ns "
                        "FROM hypermap_receipts WHERE id > ? ORDER BY id LIMIT ?"));
  select.Bind(after_id, max_count);
  std::vector<TimedReceipt> receipts;
  while (true) {
    HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Step());
    if (!has_row) return receipts;
    HYPERMAP_ASSIGN_OR_RETURN(TimedReceipt receipt, ReceiptAt(&select));
    receipts.push_back(std::move(receipt));
  }
}

absl::StatusOr<std::optional<int64_t>> ReadCommitTime(Database* database, Revision revision) {
  return database->QueryInt64("SELECT time_ns FROM hypermap_revisions WHERE revision = ?",
                              revision);
}

absl::StatusOr<std::optional<Receipt>> ReadReceipt(Database* database,
                                                   absl::string_view request_id) {
  if (request_id.empty()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(
      Statement select,
      database->Prepare("SELECT request_id, revision, object_ids, digest, time_ns "
                        "FROM hypermap_receipts WHERE request_id = ?"));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(request_id).Step());
  if (!has_row) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(TimedReceipt timed, ReceiptAt(&select));
  return std::move(timed.receipt);
}

}  // namespace hypermap::storage
