// A stored map that hands everything to another one.
#ifndef HYPERMAP_STORAGE_DECORATORS_FORWARDING_MAP_H_
#define HYPERMAP_STORAGE_DECORATORS_FORWARDING_MAP_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/map_store.h"

namespace hypermap::storage {

// A decorator derives from it, and overrides what it changes.
class ForwardingMap : public StoredMap {
 public:
  explicit ForwardingMap(std::unique_ptr<StoredMap> map) : map_(std::move(map)) {}

  const MapHeader& header() const override { return map_->header(); }
  absl::StatusOr<MapPosition> Position() override { return map_->Position(); }
  absl::StatusOr<std::vector<TimedReceipt>> Receipts(absl::string_view after,
                                                     int max_count) override {
    return map_->Receipts(after, max_count);
  }
  absl::StatusOr<std::vector<TimeMark>> TimeMarks() override { return map_->TimeMarks(); }
  FusionLog& fusion_log() override { return map_->fusion_log(); }
  absl::StatusOr<std::unique_ptr<HistoryReader>> OpenHistory() override {
    return map_->OpenHistory();
  }

  std::vector<std::string> opening_notes() const override { return map_->opening_notes(); }
  absl::Status CheckFile() override { return map_->CheckFile(); }
  absl::Status damage() const override { return map_->damage(); }
  absl::StatusOr<SnapshotPtr> Load() override { return map_->Load(); }
  absl::Status Write(absl::Span<const Commit> commits) override { return map_->Write(commits); }
  absl::Status ConfirmOwnership() override { return map_->ConfirmOwnership(); }
  void KeepOwnership() override { map_->KeepOwnership(); }
  absl::Status TryWrite() override { return map_->TryWrite(); }
  absl::StatusOr<std::optional<Receipt>> FindReceipt(absl::string_view request_id) override {
    return map_->FindReceipt(request_id);
  }
  absl::StatusOr<std::vector<Receipt>> FindReceipts(
      absl::Span<const std::string> request_ids) override {
    return map_->FindReceipts(request_ids);
  }
  absl::Status AddTimeMark(const TimeMark& mark, absl::Duration forget_before) override {
    return map_->AddTimeMark(mark, forget_before);
  }
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override {
    return map_->Compact(oldest, receipts_before, max_rows);
  }
  absl::Status AddCopied(absl::Span<const TimedReceipt> receipts,
                         absl::Span<const FusionChange> fusion) override {
    return map_->AddCopied(receipts, fusion);
  }
  absl::Status ClearCopied() override { return map_->ClearCopied(); }
  absl::Status FinishCopy() override { return map_->FinishCopy(); }
  absl::StatusOr<int64_t> BackupBytes() override { return map_->BackupBytes(); }
  absl::StatusOr<std::unique_ptr<MapBackup>> OpenBackup() override { return map_->OpenBackup(); }
  absl::StatusOr<std::unique_ptr<MapCheck>> OpenCheck() override { return map_->OpenCheck(); }

 protected:
  StoredMap& map() const { return *map_; }

 private:
  const std::unique_ptr<StoredMap> map_;
};

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_DECORATORS_FORWARDING_MAP_H_
