#include "tests/histories/server_disk.h"

#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::histories {
namespace {

constexpr double kDiskFull = 0.03;
constexpr double kKilled = 0.03;
constexpr double kMarkFails = 0.05;
constexpr double kPlanted = 0.1;
constexpr uint64_t kIncarnation = 7;

// Hands everything to a map in memory, except writes, which go over the disk.
class FaultyMap : public storage::StoredMap {
 public:
  FaultyMap(ServerDisk* disk, std::unique_ptr<storage::StoredMap> map)
      : disk_(disk), map_(std::move(map)) {}

  const storage::MapHeader& header() const override { return map_->header(); }
  std::vector<std::string> opening_notes() const override { return map_->opening_notes(); }
  absl::Status CheckFile() override { return map_->CheckFile(); }
  absl::Status damage() const override { return map_->damage(); }
  absl::StatusOr<SnapshotPtr> Load() override { return map_->Load(); }
  absl::Status Write(absl::Span<const storage::Commit> commits) override {
    return disk_->Write(*map_, commits);
  }
  absl::Status TryWrite() override {
    HYPERMAP_RETURN_IF_ERROR(disk_->CheckWritable());
    return map_->TryWrite();
  }
  absl::StatusOr<std::optional<storage::Receipt>> FindReceipt(
      absl::string_view request_id) override {
    return map_->FindReceipt(request_id);
  }
  absl::StatusOr<storage::MapPosition> Position() override { return map_->Position(); }
  absl::StatusOr<std::vector<storage::TimedReceipt>> Receipts(absl::string_view after,
                                                              int max_count) override {
    return map_->Receipts(after, max_count);
  }
  absl::StatusOr<std::vector<storage::TimeMark>> TimeMarks() override { return map_->TimeMarks(); }
  absl::Status AddTimeMark(const storage::TimeMark& mark, absl::Duration forget_before) override {
    HYPERMAP_RETURN_IF_ERROR(disk_->CheckWritable());
    return map_->AddTimeMark(mark, forget_before);
  }
  absl::StatusOr<std::unique_ptr<storage::HistoryReader>> OpenHistory() override {
    return map_->OpenHistory();
  }
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override {
    HYPERMAP_RETURN_IF_ERROR(disk_->CheckWritable());
    return map_->Compact(oldest, receipts_before, max_rows);
  }
  storage::FusionLog& fusion_log() override { return map_->fusion_log(); }
  absl::StatusOr<int64_t> BackupBytes() override { return map_->BackupBytes(); }
  absl::StatusOr<std::unique_ptr<storage::MapBackup>> OpenBackup() override {
    return map_->OpenBackup();
  }

 private:
  ServerDisk* const disk_;
  const std::unique_ptr<storage::StoredMap> map_;
};

class FaultyStore : public storage::MapStore {
 public:
  FaultyStore(ServerDisk* disk, std::unique_ptr<storage::MapStore> store)
      : disk_(disk), store_(std::move(store)) {}

  absl::StatusOr<std::vector<std::string>> List() override { return store_->List(); }
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Create(
      const storage::MapHeader& header) override {
    return store_->Create(header);
  }
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Open(const std::string& name) override {
    HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> map, store_->Open(name));
    return std::make_unique<FaultyMap>(disk_, std::move(map));
  }
  std::string FileStamp(const std::string& name) override { return store_->FileStamp(name); }
  absl::Status Delete(const std::string& name, const std::string& request_id) override {
    return store_->Delete(name, request_id);
  }
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override {
    return store_->FindDeletion(request_id);
  }

 private:
  ServerDisk* const disk_;
  const std::unique_ptr<storage::MapStore> store_;
};

}  // namespace

ServerDisk::ServerDisk(Schedule* schedule, Record* record, Volume* volume, Plant plant,
                       std::function<void()> killed)
    : schedule_(schedule),
      record_(record),
      volume_(volume),
      plant_(plant),
      killed_(std::move(killed)) {}

absl::Status ServerDisk::CreateMap() {
  storage::MapHeader header{kMap, "map", schedule_->Wall(), ""};
  header.incarnation = kIncarnation;
  HYPERMAP_ASSIGN_OR_RETURN(const std::unique_ptr<storage::MapStore> store, volume_->Open());
  return store->Create(header).status();
}

absl::StatusOr<std::unique_ptr<storage::MapStore>> ServerDisk::Open() {
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::MapStore> store, volume_->Open());
  return std::make_unique<FaultyStore>(this, std::move(store));
}

void ServerDisk::Kill() {
  if (is_killed_) return;
  volume_->Crash();
  IsKilled();
}

void ServerDisk::IsKilled() {
  is_killed_ = true;
  early_.clear();
  killed_();
}

void ServerDisk::Restart() {
  volume_->Restart();
  is_killed_ = false;
}

absl::Status ServerDisk::CheckWritable() {
  if (is_killed_) return absl::UnavailableError("the process was killed");
  if (faults_ && schedule_->Chance(kMarkFails)) return absl::ResourceExhaustedError("disk full");
  return absl::OkStatus();
}

absl::Status ServerDisk::Write(storage::StoredMap& map, absl::Span<const storage::Commit> commits) {
  HYPERMAP_RETURN_IF_ERROR(is_killed_ ? absl::UnavailableError("the process was killed")
                                      : absl::OkStatus());
  if (faults_ && schedule_->Chance(kDiskFull)) return absl::ResourceExhaustedError("disk full");
  if (!early_.empty()) HYPERMAP_RETURN_IF_ERROR(Store(map, std::exchange(early_, {})));
  if (faults_ && schedule_->Chance(kKilled)) return DieDuring(map, commits);
  if (plant_ == Plant::kPublishEarly && faults_ && schedule_->Chance(kPlanted)) {
    early_.assign(commits.begin(), commits.end());
    return absl::OkStatus();
  }
  return Store(map, commits);
}

absl::Status ServerDisk::Store(storage::StoredMap& map, absl::Span<const storage::Commit> commits) {
  volume_->BeginWrite(plant_ != Plant::kSkipSync || !schedule_->Chance(kPlanted));
  const absl::Status written = map.Write(commits);
  volume_->EndWrite();
  // They may be there after a crash: a sync that failed does not take back what was written.
  if (!written.ok()) record_->MayBeCommitted(commits);
  HYPERMAP_RETURN_IF_ERROR(written);
  for (const storage::Commit& commit : commits) {
    schedule_->Trace("disk: revision ", commit.applied.snapshot->revision, " by ", commit.author,
                     " ", commit.request_id);
  }
  record_->Committed(commits);
  return absl::OkStatus();
}

absl::Status ServerDisk::DieDuring(storage::StoredMap& map,
                                   absl::Span<const storage::Commit> commits) {
  const absl::Status killed = absl::UnavailableError("the process was killed");
  switch (schedule_->Pick(0, 2)) {
    case 0:
      Kill();
      return killed;
    case 1:
      HYPERMAP_RETURN_IF_ERROR(Store(map, commits));
      Kill();
      return killed;
    default:
      volume_->BeginWrite(/*syncs=*/true);
      const absl::Status written = map.Write(commits);
      volume_->EndWrite();
      record_->MayBeCommitted(commits);
      HYPERMAP_RETURN_IF_ERROR(written);
      volume_->CrashDuringLastWrite();
      IsKilled();
      return killed;
  }
}

}  // namespace hypermap::histories
