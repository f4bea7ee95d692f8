// One map in PostgreSQL.
#ifndef HYPERMAP_STORAGE_POSTGRES_POSTGRES_MAP_H_
#define HYPERMAP_STORAGE_POSTGRES_POSTGRES_MAP_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "storage/cache_room.h"
#include "storage/map_store.h"
#include "storage/postgres/change_writer.h"
#include "storage/postgres/fusion_log.h"
#include "storage/postgres/owned_map.h"
#include "storage/postgres/postgres_history.h"
#include "storage/postgres/postgres_store.h"

namespace hypermap::storage::postgres {

class PostgresMap : public StoredMap {
 public:
  // What an opening has read.
  struct Opened {
    MapHeader header;
    Revision revision = 0;
    Revision oldest_revision = 0;
    OpenLayers layers;
    std::vector<std::string> notes;  // StoredMap::opening_notes
    // Whether the map may have been deleted, and is read nevertheless.
    PostgresHistory::DeletedMaps deleted = PostgresHistory::DeletedMaps::kUnavailable;
  };
  struct Events {
    std::function<void()> written;         // after each commit
    std::function<void()> layers_changed;  // after one that made or deleted a layer
    std::function<void()> closed;          // at the end of the destructor, which releases the map
  };
  // What the readers of maps and backups need of the store.
  struct Facilities {
    ConnectOptions readers;
    CacheRoomPtr cache_room;
    OpenFolder open_files;  // may be null
  };
  PostgresMap(std::unique_ptr<OwnedMap> owned, Facilities facilities, Opened opened, Events events);
  ~PostgresMap() override;

  const MapHeader& header() const override { return opened_.header; }
  std::vector<std::string> opening_notes() const override { return opened_.notes; }
  absl::Status CheckFile() override { return InMap(owned_->lost()); }
  absl::StatusOr<SnapshotPtr> Load() override;
  absl::Status Write(absl::Span<const Commit> commits) override;
  absl::Status ConfirmOwnership() override { return InMap(owned_->Confirm()); }
  void KeepOwnership() override { keeps_ownership_ = true; }
  absl::Status TryWrite() override;
  absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) override;
  absl::StatusOr<std::vector<Receipt>> FindReceipts(
      absl::Span<const std::string> request_ids) override;
  absl::StatusOr<MapPosition> Position() override;
  absl::StatusOr<std::vector<TimedReceipt>> Receipts(absl::string_view after,
                                                     int max_count) override;
  absl::StatusOr<std::vector<TimeMark>> TimeMarks() override;
  absl::Status AddTimeMark(const TimeMark& mark, absl::Duration forget_before) override;
  absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() override;
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override;
  FusionLog& fusion_log() override { return fusion_; }
  absl::Status AddCopied(absl::Span<const TimedReceipt> receipts,
                         absl::Span<const FusionChange> fusion) override;
  absl::Status ClearCopied() override;
  absl::Status FinishCopy() override;
  absl::StatusOr<int64_t> BackupBytes() override;
  absl::StatusOr<std::unique_ptr<MapBackup>> OpenBackup() override;
  absl::StatusOr<std::unique_ptr<MapCheck>> OpenCheck() override;

 private:
  absl::Status WriteAll(absl::Span<const Commit> commits);
  // Sends statements in a transaction. FAILED_PRECONDITION if the map is no unfinished copy.
  absl::Status WriteToCopy(absl::FunctionRef<void(Pipeline&)> add);
  // Adds the name of the map to an error.
  absl::Status InMap(const absl::Status& status) const;

  const std::unique_ptr<OwnedMap> owned_;
  const Facilities facilities_;
  Opened opened_;
  PostgresFusionLog fusion_;
  const Events events_;
  bool keeps_ownership_ = false;
};

// Of a map that is only read: nothing happens.
PostgresMap::Events NoEvents();

// Opens a map for reading as it is at one moment, in one transaction (MapStore::Pin), also one that
// was deleted. UNAVAILABLE if its rows are gone.
absl::StatusOr<std::unique_ptr<ReadableMap>> PinMap(const PostgresMap::Facilities& facilities,
                                                    int64_t map, const MapHeader& header);

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_POSTGRES_MAP_H_
