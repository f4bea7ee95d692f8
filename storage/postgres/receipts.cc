#include "storage/postgres/receipts.h"

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "absl/types/span.h"
#include "base/status/status_macros.h"
#include "storage/encoding/object_id_list.h"
#include "storage/postgres/row_parts.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kFindReceipt[] =
    "SELECT request_id, revision, object_ids, digest, time_ns FROM hypermap.receipts "
    "WHERE map = $1 AND request_id = $2";
// The lateral query, with its limit, is run for each request: the planner can't choose to read the
// whole table instead.
constexpr char kFindReceipts[] = R"sql(
SELECT found.*
  FROM unnest($2::text[]) AS asked (request_id) CROSS JOIN LATERAL (
    SELECT request_id, revision, object_ids, digest, time_ns FROM hypermap.receipts
      WHERE map = $1 AND request_id = asked.request_id LIMIT 1) AS found
)sql";
// The time is that of the revision, so that the order is that of the revisions; it has an index.
constexpr char kReadReceipts[] =
    "SELECT request_id, revision, object_ids, digest, time_ns FROM hypermap.receipts "
    "WHERE map = $1 AND (time_ns, revision) > ($2, $3) AND time_ns >= $2 "
    "ORDER BY time_ns, revision LIMIT $4";
constexpr char kInsertReceipts[] = R"sql(
INSERT INTO hypermap.receipts (map, request_id, revision, time_ns, object_ids, digest)
  SELECT $1, r.request_id, r.revision, r.time_ns, r.object_ids, r.digest
    FROM unnest($2::text[], $3::bigint[], $4::bigint[], $5::bytea[], $6::bytea[])
      AS r (request_id, revision, time_ns, object_ids, digest)
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

absl::StatusOr<std::vector<Receipt>> FindReceipts(Connection& connection, int64_t map,
                                                  absl::Span<const std::string> request_ids) {
  const std::vector<absl::string_view> ids(request_ids.begin(), request_ids.end());
  HYPERMAP_ASSIGN_OR_RETURN(Rows rows,
                            connection.Query(kFindReceipts, map, absl::MakeConstSpan(ids)));
  std::vector<Receipt> receipts;
  while (rows.Next()) {
    HYPERMAP_ASSIGN_OR_RETURN(TimedReceipt timed, ReceiptAt(&rows));
    receipts.push_back(std::move(timed.receipt));
  }
  return receipts;
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

std::optional<TimedReceipt> ReceiptOf(const Commit& commit) {
  if (commit.request_id.empty()) return std::nullopt;
  return TimedReceipt{{commit.request_id, commit.applied.snapshot->revision,
                       commit.applied.object_ids, commit.request_digest},
                      commit.time};
}

void AddReceipts(Pipeline& pipeline, int64_t map, absl::Span<const TimedReceipt> receipts) {
  struct Row {
    const TimedReceipt* timed;
    std::string object_ids;
  };
  std::vector<Row> rows;
  rows.reserve(receipts.size());
  for (const TimedReceipt& timed : receipts) {
    rows.push_back({&timed, EncodeObjectIds(timed.receipt.object_ids)});
  }
  InParts(
      absl::MakeConstSpan(rows), [](const Row& row) { return row.object_ids.size(); },
      [&](absl::Span<const Row> part) {
        pipeline.Add(
            kInsertReceipts, map,
            Column<absl::string_view>(
                part, [](auto& r) { return absl::string_view(r.timed->receipt.request_id); }),
            Column<int64_t>(part, [](auto& r) { return r.timed->receipt.revision; }),
            Column<int64_t>(part, [](auto& r) { return absl::ToUnixNanos(r.timed->time); }),
            Column<BlobView>(part, [](auto& r) { return BlobView{r.object_ids}; }),
            Column<BlobView>(part,
                             [](auto& r) { return BlobView{r.timed->receipt.request_digest}; }));
      });
}

}  // namespace hypermap::storage::postgres
