#include "tests/histories/server_disk.h"

#include <utility>

#include "base/status/status_macros.h"
#include "storage/decorators/forwarding_map.h"
#include "storage/decorators/forwarding_store.h"

namespace hypermap::histories {
namespace {

constexpr double kDiskFull = 0.03;
constexpr double kKilled = 0.03;
constexpr double kMarkFails = 0.05;
constexpr double kPlanted = 0.1;
constexpr uint64_t kIncarnation = 7;

// Its writes go over the disk.
class FaultyMap : public storage::ForwardingMap {
 public:
  FaultyMap(ServerDisk* disk, std::unique_ptr<storage::StoredMap> map)
      : ForwardingMap(std::move(map)), disk_(disk) {}

  absl::Status Write(absl::Span<const storage::Commit> commits) override {
    return disk_->Write(map(), commits);
  }
  absl::Status TryWrite() override {
    HYPERMAP_RETURN_IF_ERROR(disk_->CheckWritable());
    return map().TryWrite();
  }
  absl::Status AddTimeMark(const storage::TimeMark& mark, absl::Duration forget_before) override {
    HYPERMAP_RETURN_IF_ERROR(disk_->CheckWritable());
    return map().AddTimeMark(mark, forget_before);
  }
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override {
    HYPERMAP_RETURN_IF_ERROR(disk_->CheckWritable());
    return map().Compact(oldest, receipts_before, max_rows);
  }

 private:
  ServerDisk* const disk_;
};

class FaultyStore : public storage::ForwardingStore {
 public:
  FaultyStore(ServerDisk* disk, std::unique_ptr<storage::MapStore> store)
      : ForwardingStore(std::move(store)), disk_(disk) {}

  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Open(const std::string& name) override {
    HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<storage::StoredMap> map, store().Open(name));
    return std::make_unique<FaultyMap>(disk_, std::move(map));
  }

 private:
  ServerDisk* const disk_;
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
