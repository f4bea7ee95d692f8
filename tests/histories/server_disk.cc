#include "tests/histories/server_disk.h"

#include <utility>

#include "base/status/status_macros.h"

namespace hypermap::histories {
namespace {

constexpr double kDiskFull = 0.03;
constexpr double kKilledBefore = 0.01;
constexpr double kKilledAfter = 0.02;
constexpr double kMarkFails = 0.05;
constexpr double kPlanted = 0.1;
constexpr uint64_t kIncarnation = 7;

// Hands everything to a map in memory, except writes, which go over the disk.
class FaultyMap : public storage::StoredMap {
 public:
  FaultyMap(ServerDisk* disk, std::unique_ptr<storage::StoredMap> map)
      : disk_(disk), map_(std::move(map)) {}

  const storage::MapHeader& header() const override { return map_->header(); }
  absl::StatusOr<SnapshotPtr> Load() override { return map_->Load(); }
  absl::Status Write(absl::Span<const storage::Commit> commits) override {
    return disk_->Write(*map_, commits);
  }
  absl::StatusOr<std::optional<storage::Receipt>> FindReceipt(
      absl::string_view request_id) override {
    return map_->FindReceipt(request_id);
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
  FaultyStore(ServerDisk* disk, server::MemoryDisk* memory) : disk_(disk), store_(memory) {}

  absl::StatusOr<std::vector<std::string>> List() override { return store_.List(); }
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Create(
      const storage::MapHeader& header) override {
    return store_.Create(header);
  }
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Open(const std::string& name) override {
    HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> map, store_.Open(name));
    return std::make_unique<FaultyMap>(disk_, std::move(map));
  }
  absl::Status Delete(const std::string& name, const std::string& request_id) override {
    return store_.Delete(name, request_id);
  }
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override {
    return store_.FindDeletion(request_id);
  }

 private:
  ServerDisk* const disk_;
  server::MemoryMapStore store_;
};

}  // namespace

ServerDisk::ServerDisk(Schedule* schedule, Record* record, Plant plant,
                       std::function<void()> killed)
    : schedule_(schedule), record_(record), plant_(plant), killed_(std::move(killed)) {}

absl::Status ServerDisk::CreateMap() {
  storage::MapHeader header{kMap, "map", schedule_->Wall(), ""};
  header.incarnation = kIncarnation;
  return server::MemoryMapStore(&memory_).Create(header).status();
}

std::unique_ptr<storage::MapStore> ServerDisk::Open() {
  return std::make_unique<FaultyStore>(this, &memory_);
}

void ServerDisk::Kill() {
  if (is_killed()) return;
  killed_at_ = synced_ ? *std::move(synced_) : memory_.Save();
  synced_.reset();
  early_.clear();
  killed_();
}

void ServerDisk::Restart() {
  memory_.Restore(*killed_at_);
  killed_at_.reset();
}

absl::Status ServerDisk::CheckWritable() {
  if (is_killed()) return absl::UnavailableError("the process was killed");
  if (faults_ && schedule_->Chance(kMarkFails)) return absl::ResourceExhaustedError("disk full");
  return absl::OkStatus();
}

absl::Status ServerDisk::Write(storage::StoredMap& map, absl::Span<const storage::Commit> commits) {
  if (is_killed()) return absl::UnavailableError("the process was killed");
  if (faults_ && schedule_->Chance(kDiskFull)) return absl::ResourceExhaustedError("disk full");
  if (faults_ && schedule_->Chance(kKilledBefore)) {
    Kill();
    return absl::UnavailableError("the process was killed");
  }
  if (!early_.empty()) HYPERMAP_RETURN_IF_ERROR(Store(map, std::exchange(early_, {})));
  if (plant_ == Plant::kPublishEarly && faults_ && schedule_->Chance(kPlanted)) {
    early_.assign(commits.begin(), commits.end());
    return absl::OkStatus();
  }
  const bool syncs = plant_ != Plant::kSkipSync || !schedule_->Chance(kPlanted);
  if (!syncs && !synced_) synced_ = memory_.Save();
  HYPERMAP_RETURN_IF_ERROR(Store(map, commits));
  if (syncs) synced_.reset();
  if (!faults_ || !schedule_->Chance(kKilledAfter)) return absl::OkStatus();
  Kill();
  return absl::UnavailableError("the process was killed");
}

absl::Status ServerDisk::Store(storage::StoredMap& map, absl::Span<const storage::Commit> commits) {
  HYPERMAP_RETURN_IF_ERROR(map.Write(commits));
  for (const storage::Commit& commit : commits) {
    schedule_->Trace("disk: revision ", commit.applied.snapshot->revision, " by ", commit.author,
                     " ", commit.request_id);
  }
  record_->Committed(commits);
  return absl::OkStatus();
}

}  // namespace hypermap::histories
