#include "storage/postgres/receipts.h"

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/status/status_macros.h"
#include "storage/encoding/object_id_list.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kFindReceipt[] =
    "SELECT request_id, revision, object_ids, digest, time_ns FROM hypermap.receipts "
    "WHERE map = $1 AND request_id = $2";
// The time is that of the revision, so that the order is that of the revisions; it has an index.
constexpr char kReadReceipts[] =
    "SELECT request_id, revision, object_ids, digest, time_ns FROM hypermap.receipts "
    "WHERE map = $1 AND (time_ns, revision) > ($2, $3) AND time_ns >= $2 "
    "ORDER BY time_ns, revision LIMIT $4";
constexpr char kInsertReceipt[] = R"sql(
INSERT INTO hypermap.receipts (map, request_id, revision, time_ns, object_ids, digest)
  VALUES ($1, $2, $3, $4, $5, $6)
)sql";

absl::StatusOr<TimedReceipt> ReceiptAt(Rows* rows) {
  TimedReceipt timed;
  timed.receipt.request_id = std::string(rows->Text(0));
  timed.receipt.revision = rows->Int64(1);
  const absl::string_view object_ids = rows->Blob(2);
  timed.receipt.request_digest = std::string(rows->Blob(3));
  timed.time = absl::FromUnixNanos(rows->Int64(4));
  absl::StatusOr<std::vector<ObjectId>> ids = std::vector<ObjectId>();
  if (rows->row_status().ok()) ids = DecodeObjectIds(object_ids);
  const absl::Status& status = rows->row_status().ok() ? ids.status() : rows->row_status();
  if (!status.ok()) {
    return absl::DataLossError(absl::StrCat("hypermap.receipts, request_id ",
                                            timed.receipt.request_id, ": ", status.message()));
  }
  timed.receipt.object_ids = *std::move(ids);
  return timed;
}

absl::StatusOr<std::optional<TimedReceipt>> FindTimedReceipt(Connection& connection, int64_t map,
                                                             absl::string_view request_id) {
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows, connection.Query(kFindReceipt, map, request_id));
  if (!rows.Next()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(TimedReceipt receipt, ReceiptAt(&rows));
  return receipt;
}

}  // namespace

absl::StatusOr<std::optional<Receipt>> FindReceipt(Connection& connection, int64_t map,
                                                   absl::string_view request_id) {
  if (request_id.empty()) return std::nullopt;
  HYPERMAP_ASSIGN_OR_RETURN(std::optional<TimedReceipt> timed,
                            FindTimedReceipt(connection, map, request_id));
  if (!timed) return std::nullopt;
  return std::move(timed->receipt);
}

absl::StatusOr<std::vector<TimedReceipt>> ReadReceipts(Connection& connection, int64_t map,
                                                       absl::string_view after, int max_count) {
  int64_t time_ns = std::numeric_limits<int64_t>::min();
  Revision revision = 0;
  if (!after.empty()) {
    HYPERMAP_ASSIGN_OR_RETURN(const std::optional<TimedReceipt> last,
                              FindTimedReceipt(connection, map, after));
    if (!last) {
      return absl::UnavailableError(
          absl::StrCat("the receipt of request_id ", after, " was removed meanwhile"));
    }
    time_ns = absl::ToUnixNanos(last->time);
    revision = last->receipt.revision;
  }
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                            connection.Query(kReadReceipts, map, time_ns, revision, max_count));
  std::vector<TimedReceipt> receipts;
  while (rows.Next()) {
    HYPERMAP_ASSIGN_OR_RETURN(TimedReceipt receipt, ReceiptAt(&rows));
    receipts.push_back(std::move(receipt));
  }
  return receipts;
}

void AddReceipt(Pipeline& pipeline, int64_t map, const TimedReceipt& timed) {
  const Receipt& receipt = timed.receipt;
  const std::string object_ids = EncodeObjectIds(receipt.object_ids);
  pipeline.Add(kInsertReceipt, map, receipt.request_id, receipt.revision,
               absl::ToUnixNanos(timed.time), BlobView{object_ids},
               BlobView{receipt.request_digest});
}

void AddReceipt(Pipeline& pipeline, int64_t map, const Commit& commit) {
  if (commit.request_id.empty()) return;
  AddReceipt(pipeline, map,
             TimedReceipt{{commit.request_id, commit.applied.snapshot->revision,
                           commit.applied.object_ids, commit.request_digest},
                          commit.time});
}

}  // namespace hypermap::storage::postgres
