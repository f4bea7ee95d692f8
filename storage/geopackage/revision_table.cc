#include "storage/geopackage/revision_table.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/geopackage/object_id_list.h"

namespace hypermap::storage {

absl::Status InsertRevision(Database* database, const Commit& commit) {
  const Revision revision = commit.applied.snapshot->revision;
  absl::Status status = database->Run(
      "INSERT INTO hypermap_revisions (revision, time_ns, author, num_changes) "
      "VALUES (?, ?, ?, ?)",
      revision, absl::ToUnixNanos(commit.time), commit.author,
      static_cast<int64_t>(commit.applied.changes.size()));
  if (!status.ok() || commit.request_id.empty()) return status;
  const std::string object_ids = EncodeObjectIds(commit.applied.object_ids);
  status = database->Run(
      "INSERT OR IGNORE INTO hypermap_receipts (request_id, revision, time_ns, object_ids, digest) "
      "VALUES (?, ?, ?, ?, ?)",
      commit.request_id, revision, absl::ToUnixNanos(commit.time), BlobView{object_ids},
      BlobView{commit.request_digest});
  if (status.ok() && database->changed_rows() == 0) {
    return absl::AlreadyExistsError(
        absl::StrCat("request_id ", commit.request_id, " was answered before"));
  }
  return status;
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
      database->Prepare(
          "SELECT revision, object_ids, digest FROM hypermap_receipts WHERE request_id = ?"));
  HYPERMAP_ASSIGN_OR_RETURN(const bool has_row, select.Bind(request_id).Step());
  if (!has_row) return std::nullopt;
  Receipt receipt;
  receipt.request_id = std::string(request_id);
  receipt.revision = select.Int64(0);
  const absl::string_view bytes = select.Blob(1);
  if (!select.IsNull(2)) receipt.request_digest = std::string(select.Blob(2));
  HYPERMAP_RETURN_IF_ERROR(select.row_status());
  HYPERMAP_ASSIGN_OR_RETURN(std::vector<ObjectId> ids, DecodeObjectIds(bytes));
  receipt.object_ids = std::move(ids);
  return receipt;
}

}  // namespace hypermap::storage
