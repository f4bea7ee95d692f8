#include "storage/postgres/postgres_map.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "storage/ownership.h"
#include "storage/postgres/compaction.h"
#include "storage/postgres/file_copies.h"
#include "storage/postgres/fusion_changes.h"
#include "storage/postgres/map_check.h"
#include "storage/postgres/map_loading.h"
#include "storage/postgres/map_row.h"
#include "storage/postgres/postgres_history.h"
#include "storage/postgres/receipts.h"
#include "storage/postgres/time_marks.h"

namespace hypermap::storage::postgres {
namespace {

constexpr char kSetOldest[] = "UPDATE hypermap.maps SET oldest_revision = $2 WHERE id = $1";

constexpr char kFinishCopy[] =
    "UPDATE hypermap.maps SET unfinished_copy = false, provisional = false WHERE id = $1";

int64_t NumCreated(absl::Span<const Change> changes) {
  return std::count_if(changes.begin(), changes.end(), [](const Change& change) {
    return std::holds_alternative<LayerCreated>(change);
  });
}

}  // namespace

PostgresMap::PostgresMap(std::unique_ptr<OwnedMap> owned, Facilities facilities, Opened opened,
                         Events events)
    : owned_(std::move(owned)),
      facilities_(std::move(facilities)),
      opened_(std::move(opened)),
      fusion_(owned_.get()),
      events_(std::move(events)) {}

PostgresMap::~PostgresMap() {
  if (!keeps_ownership_) owned_->Release();
  events_.closed();
}

absl::Status PostgresMap::InMap(const absl::Status& status) const {
  if (status.ok()) return status;
  const std::string message = absl::StrCat("map ", opened_.header.name, ": ", status.message());
  if (IsLostOwnership(status)) return LostOwnershipError(message);
  return absl::Status(status.code(), message);
}

absl::StatusOr<SnapshotPtr> PostgresMap::Load() {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<SnapshotPtr> snapshot =
      LoadSnapshot(connection, owned_->map(), opened_.header.name);
  if (!snapshot.ok()) return InMap(snapshot.status());
  return snapshot;
}

absl::Status PostgresMap::Write(absl::Span<const Commit> commits) {
  return commits.empty() ? absl::OkStatus() : InMap(WriteAll(commits));
}

absl::Status PostgresMap::WriteAll(absl::Span<const Commit> commits) {
  const Snapshot& newest = *commits.back().applied.snapshot;
  // The transaction advances the row first, so that the new layers are counted before.
  OwnedMap::Advance advance{opened_.revision, newest.revision, newest.next_object_id,
                            opened_.layers.next_lineage};
  for (const Commit& commit : commits) advance.next_lineage += NumCreated(commit.applied.changes);
  OpenLayers layers;
  const auto send = [&](Pipeline& pipeline) -> absl::Status {
    ChangeWriter writer(&pipeline, owned_->map(), opened_.layers);
    for (const Commit& commit : commits) HYPERMAP_RETURN_IF_ERROR(writer.Write(commit));
    writer.Finish();
    layers = writer.layers();
    return absl::OkStatus();
  };
  HYPERMAP_RETURN_IF_ERROR(owned_->Write(send, advance));
  // The first commit makes the map one that others see.
  const bool layers_changed = opened_.header.provisional ||
                              layers.next_lineage != opened_.layers.next_lineage ||
                              layers.by_name.size() != opened_.layers.by_name.size();
  opened_.layers = std::move(layers);
  opened_.revision = newest.revision;
  opened_.header.provisional = false;
  events_.written();
  if (layers_changed) events_.layers_changed();
  return absl::OkStatus();
}

absl::Status PostgresMap::TryWrite() {
  return InMap(owned_->Write([](Pipeline&) { return absl::OkStatus(); }));
}

absl::StatusOr<std::optional<Receipt>> PostgresMap::FindReceipt(absl::string_view request_id) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<std::optional<Receipt>> receipt =
      postgres::FindReceipt(*connection, owned_->map(), request_id);
  if (!receipt.ok()) return InMap(receipt.status());
  return receipt;
}

absl::StatusOr<std::vector<Receipt>> PostgresMap::FindReceipts(
    absl::Span<const std::string> request_ids) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<std::vector<Receipt>> receipts =
      postgres::FindReceipts(*connection, owned_->map(), request_ids);
  if (!receipts.ok()) return InMap(receipts.status());
  return receipts;
}

absl::StatusOr<MapPosition> PostgresMap::Position() {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<MapPosition> position = ReadPosition(connection, owned_->map());
  if (!position.ok()) return InMap(position.status());
  return position;
}

absl::StatusOr<std::vector<TimedReceipt>> PostgresMap::Receipts(absl::string_view after,
                                                                int max_count) {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<std::vector<TimedReceipt>> receipts =
      ReadReceipts(*connection, owned_->map(), after, max_count);
  if (!receipts.ok()) return InMap(receipts.status());
  return receipts;
}

absl::Status PostgresMap::WriteToCopy(absl::FunctionRef<void(Pipeline&)> add) {
  if (!opened_.header.unfinished_copy) {
    return InMap(absl::FailedPreconditionError("the map is no unfinished copy"));
  }
  return InMap(owned_->Write([&](Pipeline& pipeline) {
    add(pipeline);
    return absl::OkStatus();
  }));
}

absl::Status PostgresMap::AddCopied(absl::Span<const TimedReceipt> receipts,
                                    absl::Span<const FusionChange> fusion) {
  return WriteToCopy([&](Pipeline& pipeline) {
    AddReceipts(pipeline, owned_->map(), receipts);
    for (const FusionChange& change : fusion) AddFusionChange(pipeline, owned_->map(), change);
  });
}

absl::Status PostgresMap::ClearCopied() {
  return WriteToCopy([&](Pipeline& pipeline) {
    for (const char* const table : {"receipts", "time_marks"}) {
      pipeline.Add(absl::StrCat("DELETE FROM hypermap.", table, " WHERE map = $1"), owned_->map());
    }
    DropAllFusion(pipeline, owned_->map());
  });
}

absl::Status PostgresMap::FinishCopy() {
  const absl::Status status =
      WriteToCopy([&](Pipeline& pipeline) { pipeline.Add(kFinishCopy, owned_->map()); });
  HYPERMAP_RETURN_IF_ERROR(status);
  opened_.header.unfinished_copy = false;
  events_.written();
  events_.layers_changed();
  return absl::OkStatus();
}

absl::StatusOr<std::vector<TimeMark>> PostgresMap::TimeMarks() {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<std::vector<TimeMark>> marks = ReadTimeMarks(*connection, owned_->map());
  if (!marks.ok()) return InMap(marks.status());
  return marks;
}

absl::Status PostgresMap::AddTimeMark(const TimeMark& mark, absl::Duration forget_before) {
  return InMap(postgres::AddTimeMark(*owned_, mark, forget_before));
}

absl::StatusOr<std::unique_ptr<HistoryReader>> PostgresMap::OpenHistory() {
  // Any thread may call this: it uses only members that never change.
  return std::make_unique<PostgresHistory>(facilities_.readers, owned_->map(), opened_.header.name,
                                           facilities_.cache_room, opened_.deleted);
}

absl::StatusOr<bool> PostgresMap::Compact(Revision oldest, absl::Time receipts_before,
                                          int max_rows) {
  const Revision kept = std::max(std::min(oldest, opened_.revision), opened_.oldest_revision);
  bool more = false;
  const auto remove = [&](Connection& connection) -> absl::Status {
    if (kept > opened_.oldest_revision) {
      HYPERMAP_RETURN_IF_ERROR(connection.Query(kSetOldest, owned_->map(), kept).status());
    }
    HYPERMAP_ASSIGN_OR_RETURN(
        more, RemoveForgotten(connection, owned_->map(), kept, receipts_before, max_rows));
    return absl::OkStatus();
  };
  HYPERMAP_RETURN_IF_ERROR(InMap(owned_->WriteInSteps(remove)));
  opened_.oldest_revision = kept;
  return more;
}

absl::StatusOr<int64_t> PostgresMap::BackupBytes() {
  HYPERMAP_ASSIGN_OR_RETURN(Connection* const connection, owned_->connection());
  absl::StatusOr<int64_t> bytes = BytesOfFileBackup(*connection, owned_->map());
  if (!bytes.ok()) return InMap(bytes.status());
  return bytes;
}

absl::StatusOr<std::unique_ptr<MapBackup>> PostgresMap::OpenBackup() {
  if (facilities_.open_files == nullptr) {
    return absl::UnimplementedError("this store can't make files of its maps");
  }
  if (absl::IsDataLoss(owned_->lost())) return InMap(owned_->lost());
  const auto pin = [facilities = facilities_, map = owned_->map(), header = opened_.header] {
    return PinMap(facilities, map, header);
  };
  return MakeFileBackup(facilities_.open_files, opened_.header.name, pin);
}

absl::StatusOr<std::unique_ptr<MapCheck>> PostgresMap::OpenCheck() {
  if (absl::IsDataLoss(owned_->lost())) return InMap(owned_->lost());
  return MakeMapCheck(facilities_.readers, owned_->map(), opened_.header.name);
}

PostgresMap::Events NoEvents() {
  return {[] {}, [] {}, [] {}};
}

absl::StatusOr<std::unique_ptr<ReadableMap>> PinMap(const PostgresMap::Facilities& facilities,
                                                    int64_t map, const MapHeader& header) {
  PostgresMap::Opened opened;
  opened.header = header;
  opened.deleted = PostgresHistory::DeletedMaps::kRead;
  auto pinned = std::make_unique<PostgresMap>(OwnedMap::AtOneMoment(facilities.readers, map),
                                              facilities, std::move(opened), NoEvents());
  // The moment is that of the first read.
  HYPERMAP_RETURN_IF_ERROR(pinned->Position().status());
  return pinned;
}

}  // namespace hypermap::storage::postgres
