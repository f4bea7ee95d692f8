#include "server/session/testing/memory_map_store.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"
#include "map/layers/layer_spec.h"
#include "storage/incarnation.h"
#include "storage/unfinished_copy.h"

namespace hypermap::server {
namespace {

class MemoryBackup : public storage::MapBackup {
 public:
  explicit MemoryBackup(std::string content) : content_(std::move(content)) {}
  absl::Status WriteTo(const std::string& path) override {
    if (std::filesystem::exists(path)) return absl::AlreadyExistsError(path);
    std::ofstream file(path);
    file << content_;
    return file.flush() ? absl::OkStatus() : absl::UnavailableError(path);
  }

 private:
  const std::string content_;
};

absl::Status IsOpenError(const std::string& name) {
  return absl::FailedPreconditionError(absl::StrCat("map ", name, " is open"));
}

}  // namespace

class MemoryMap : public storage::StoredMap {
 public:
  MemoryMap(MemoryDisk* disk, std::shared_ptr<MemoryDisk::File> file)
      : disk_(disk), file_(std::move(file)) {}
  ~MemoryMap() override {
    MutexLock lock(&disk_->mutex_);
    file_->open = false;
  }

  const storage::MapHeader& header() const override { return file_->header; }
  absl::Status CheckFile() override {
    MutexLock lock(&disk_->mutex_);
    return disk_->file_status_;
  }
  absl::StatusOr<SnapshotPtr> Load() override { return file_->snapshot; }
  absl::Status Write(absl::Span<const storage::Commit> commits) override {
    return disk_->Write(*file_, commits);
  }
  absl::Status ConfirmOwnership() override { return CheckFile(); }
  absl::Status TryWrite() override {
    const MutexLock lock(&disk_->mutex_);
    return disk_->write_status_;
  }
  absl::StatusOr<std::optional<storage::Receipt>> FindReceipt(
      absl::string_view request_id) override {
    const auto it = file_->receipts.find(std::string_view(request_id.data(), request_id.size()));
    if (it == file_->receipts.end()) return std::nullopt;
    return it->second.receipt;
  }
  absl::StatusOr<storage::MapPosition> Position() override {
    return storage::MapPosition{file_->history->Kept(), file_->snapshot->next_object_id};
  }
  absl::StatusOr<std::vector<storage::TimedReceipt>> Receipts(absl::string_view after,
                                                              int max_count) override;
  absl::StatusOr<std::vector<storage::TimeMark>> TimeMarks() override { return file_->marks; }
  absl::Status AddTimeMark(const storage::TimeMark& mark, absl::Duration forget_before) override {
    return disk_->AddTimeMark(*file_, mark, forget_before);
  }
  absl::StatusOr<std::unique_ptr<storage::HistoryReader>> OpenHistory() override {
    return std::make_unique<MemoryHistoryReader>(file_->history);
  }
  absl::StatusOr<bool> Compact(Revision oldest, absl::Time receipts_before, int max_rows) override {
    for (auto it = file_->receipts.begin(); it != file_->receipts.end();) {
      it = it->second.time < receipts_before ? file_->receipts.erase(it) : std::next(it);
    }
    return file_->history->Forget(oldest, max_rows);
  }
  storage::FusionLog& fusion_log() override { return file_->fusion; }
  absl::Status AddCopied(absl::Span<const storage::TimedReceipt> receipts,
                         absl::Span<const storage::FusionChange> fusion) override {
    HYPERMAP_RETURN_IF_ERROR(CheckIsCopy());
    for (const storage::TimedReceipt& timed : receipts) {
      file_->receipts[timed.receipt.request_id] = timed;
    }
    for (const storage::FusionChange& change : fusion) file_->fusion.Apply(change);
    return absl::OkStatus();
  }
  absl::Status ClearCopied() override {
    HYPERMAP_RETURN_IF_ERROR(CheckIsCopy());
    file_->receipts.clear();
    file_->marks.clear();
    file_->fusion.DropAll();
    return absl::OkStatus();
  }
  absl::Status FinishCopy() override {
    HYPERMAP_RETURN_IF_ERROR(CheckIsCopy());
    file_->header.unfinished_copy = false;
    return absl::OkStatus();
  }
  absl::StatusOr<int64_t> BackupBytes() override { return Backup().size(); }
  absl::StatusOr<std::unique_ptr<storage::MapBackup>> OpenBackup() override {
    return std::make_unique<MemoryBackup>(Backup());
  }

 private:
  absl::Status CheckIsCopy() const {
    return file_->header.unfinished_copy ? absl::OkStatus()
                                         : absl::FailedPreconditionError("no unfinished copy");
  }
  std::string Backup() const {
    return absl::StrCat("copy of ", file_->header.name, " at revision ", file_->snapshot->revision);
  }

  MemoryDisk* const disk_;
  const std::shared_ptr<MemoryDisk::File> file_;
};

absl::StatusOr<std::vector<storage::TimedReceipt>> MemoryMap::Receipts(absl::string_view after,
                                                                       int max_count) {
  std::map<Revision, storage::TimedReceipt> by_revision;
  Revision after_revision = 0;
  for (const auto& [id, timed] : file_->receipts) {
    by_revision[timed.receipt.revision] = timed;
    if (!after.empty() && timed.receipt.request_id == after) {
      after_revision = timed.receipt.revision;
    }
  }
  if (!after.empty() && after_revision == 0) return absl::UnavailableError("no such receipt");
  std::vector<storage::TimedReceipt> receipts;
  for (auto it = by_revision.upper_bound(after_revision);
       it != by_revision.end() && static_cast<int>(receipts.size()) < max_count; ++it) {
    receipts.push_back(it->second);
  }
  return receipts;
}

void MemoryDisk::Hold() {
  MutexLock lock(&mutex_);
  held_ = true;
}

void MemoryDisk::Release() {
  MutexLock lock(&mutex_);
  held_ = false;
  changed_.NotifyAll();
}

void MemoryDisk::AwaitHeldWrite() {
  MutexLock lock(&mutex_);
  while (waiting_ == 0) changed_.Wait(&mutex_);
}

void MemoryDisk::FailWrites(absl::Status status) {
  MutexLock lock(&mutex_);
  write_status_ = std::move(status);
}

void MemoryDisk::BreakFiles(const absl::Status& status) {
  MutexLock lock(&mutex_);
  write_status_ = status;
  file_status_ = status;
}

void MemoryDisk::FailCreationsLate(absl::Status status) {
  MutexLock lock(&mutex_);
  creation_status_ = std::move(status);
}

void MemoryDisk::FailDeletions(absl::Status status) {
  MutexLock lock(&mutex_);
  deletion_status_ = std::move(status);
}

MemoryDisk::Image MemoryDisk::Save() const {
  MutexLock lock(&mutex_);
  Image image;
  for (const auto& [name, file] : files_) {
    auto copy = std::make_shared<File>(*file);
    copy->history = file->history->Copy();
    copy->open = false;
    image.files.emplace(name, std::move(copy));
  }
  image.deletions = deletions_;
  return image;
}

void MemoryDisk::Restore(const Image& image) {
  MutexLock lock(&mutex_);
  files_.clear();
  for (const auto& [name, file] : image.files) {
    auto copy = std::make_shared<File>(*file);
    copy->history = file->history->Copy();
    files_.emplace(name, std::move(copy));
  }
  deletions_ = image.deletions;
}

std::vector<size_t> MemoryDisk::writes() const {
  MutexLock lock(&mutex_);
  return writes_;
}

absl::Status MemoryDisk::CheckRequests(const File& file,
                                       absl::Span<const storage::Commit> commits) {
  std::set<std::string> ids;
  for (const storage::Commit& commit : commits) {
    const std::string& id = commit.request_id;
    if (id.empty()) continue;
    if (file.receipts.contains(id) || !ids.insert(id).second) {
      return absl::AlreadyExistsError(absl::StrCat("request_id ", id, " was answered before"));
    }
  }
  return absl::OkStatus();
}

absl::Status MemoryDisk::Write(File& file, absl::Span<const storage::Commit> commits) {
  MutexLock lock(&mutex_);
  ++waiting_;
  changed_.NotifyAll();
  while (held_) changed_.Wait(&mutex_);
  --waiting_;
  HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
  HYPERMAP_RETURN_IF_ERROR(write_status_);
  HYPERMAP_RETURN_IF_ERROR(CheckRequests(file, commits));
  writes_.push_back(commits.size());
  file.header.provisional = false;
  for (const storage::Commit& commit : commits) {
    file.snapshot = commit.applied.snapshot;
    file.history->Add(commit);
    for (const Change& change : commit.applied.changes) {
      if (const auto* deleted = std::get_if<LayerDeleted>(&change)) {
        file.fusion.Drop(deleted->spec.name);
      }
    }
    for (const storage::FusionChange& change : commit.fusion) file.fusion.Apply(change);
    if (commit.request_id.empty()) continue;
    file.receipts[commit.request_id] = {{commit.request_id, file.snapshot->revision,
                                         commit.applied.object_ids, commit.request_digest},
                                        commit.time};
  }
  return absl::OkStatus();
}

absl::Status MemoryDisk::AddTimeMark(File& file, const storage::TimeMark& mark,
                                     absl::Duration forget_before) {
  MutexLock lock(&mutex_);
  HYPERMAP_RETURN_IF_ERROR(write_status_);
  file.marks.push_back(mark);
  auto first = file.marks.begin();
  while (std::next(first) != file.marks.end() && std::next(first)->passed < forget_before) ++first;
  file.marks.erase(file.marks.begin(), first);
  return absl::OkStatus();
}

void MemoryDisk::HoldNewest() {
  const MutexLock lock(&mutex_);
  newest_held_ = true;
}

void MemoryDisk::ReleaseNewest() {
  const MutexLock lock(&mutex_);
  newest_held_ = false;
  changed_.NotifyAll();
}

void MemoryDisk::AwaitHeldNewest() {
  MutexLock lock(&mutex_);
  while (newest_waiting_ == 0) changed_.Wait(&mutex_);
}

void MemoryDisk::FailNewest(absl::Status status) {
  const MutexLock lock(&mutex_);
  newest_status_ = std::move(status);
}

void MemoryDisk::TellNewest(const std::string& map, storage::NewestRevision newest) {
  const MutexLock lock(&mutex_);
  newest_[map] = newest;
}

std::vector<std::vector<std::string>> MemoryDisk::newest_reads() const {
  const MutexLock lock(&mutex_);
  return newest_reads_;
}

absl::StatusOr<storage::Survey> MemoryMapStore::TakeSurvey() {
  if (server_id_.empty()) return MapStore::TakeSurvey();
  const MutexLock lock(&disk_->mutex_);
  storage::Survey survey;
  survey.servers.push_back({server_id_, ""});
  for (const auto& [name, file] : disk_->files_) {
    if (file->header.provisional) continue;
    survey.maps.push_back({name, file->header.incarnation, file->snapshot->revision, server_id_});
  }
  return survey;
}

absl::StatusOr<std::map<std::string, storage::NewestRevision>> MemoryMapStore::NewestRevisions(
    const std::vector<std::string>& names) {
  MutexLock lock(&disk_->mutex_);
  disk_->newest_reads_.push_back(names);
  ++disk_->newest_waiting_;
  disk_->changed_.NotifyAll();
  while (disk_->newest_held_) disk_->changed_.Wait(&disk_->mutex_);
  --disk_->newest_waiting_;
  HYPERMAP_RETURN_IF_ERROR(disk_->newest_status_);
  std::map<std::string, storage::NewestRevision> newest;
  for (const std::string& name : names) {
    const auto told = disk_->newest_.find(name);
    const auto file = disk_->files_.find(name);
    if (told != disk_->newest_.end()) {
      newest[name] = told->second;
    } else if (file != disk_->files_.end()) {
      newest[name] = {file->second->header.incarnation, file->second->snapshot->revision};
    }
  }
  return newest;
}

std::shared_ptr<MemoryDisk::File> MemoryMapStore::MakeFile(const storage::MapHeader& header) {
  auto file = std::make_shared<MemoryDisk::File>();
  file->header = header;
  if (file->header.incarnation == 0) file->header.incarnation = storage::NewIncarnation();
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->map_name = header.name;
  snapshot->frame_id = header.frame_id;
  file->history->Begin(snapshot, header.created_at);
  file->snapshot = std::move(snapshot);
  return file;
}

void MemoryMapStore::AddBroken(const std::string& name, absl::Status problem) {
  MutexLock lock(&disk_->mutex_);
  auto file = MakeFile({name, "map", absl::UnixEpoch(), ""});
  file->problem = std::move(problem);
  disk_->files_[name] = std::move(file);
}

std::string MemoryMapStore::FileStamp(const std::string& name) {
  const MutexLock lock(&disk_->mutex_);
  const auto it = disk_->files_.find(name);
  if (it == disk_->files_.end()) return "";
  const MemoryDisk::File& file = *it->second;
  return absl::StrCat(file.header.incarnation, " ", file.snapshot->revision, " ",
                      file.problem.ToString());
}

absl::StatusOr<std::vector<std::string>> MemoryMapStore::List() {
  MutexLock lock(&disk_->mutex_);
  std::vector<std::string> names;
  for (const auto& [name, file] : disk_->files_) names.push_back(name);
  return names;
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> MemoryMapStore::Create(
    const storage::MapHeader& header) {
  absl::Status status = ValidateName("map", header.name);
  if (status.ok()) status = ValidateFrameId("frame_id", header.frame_id);
  HYPERMAP_RETURN_IF_ERROR(status);
  auto file = MakeFile(header);
  MutexLock lock(&disk_->mutex_);
  if (!disk_->files_.emplace(header.name, file).second) {
    return absl::AlreadyExistsError(header.name);
  }
  HYPERMAP_RETURN_IF_ERROR(disk_->creation_status_);
  file->open = true;
  return std::make_unique<MemoryMap>(disk_, std::move(file));
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> MemoryMapStore::Open(const std::string& name) {
  return OpenAs(name, /*unfinished_copy=*/false);
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> MemoryMapStore::OpenUnfinishedCopy(
    const std::string& name) {
  return OpenAs(name, /*unfinished_copy=*/true);
}

absl::StatusOr<std::unique_ptr<storage::StoredMap>> MemoryMapStore::OpenAs(const std::string& name,
                                                                           bool unfinished_copy) {
  ++num_openings_;
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  MutexLock lock(&disk_->mutex_);
  const auto it = disk_->files_.find(name);
  if (it == disk_->files_.end()) return absl::NotFoundError(name);
  if (!it->second->problem.ok()) return it->second->problem;
  if (it->second->open) return IsOpenError(name);
  if (it->second->header.unfinished_copy != unfinished_copy) {
    return unfinished_copy ? absl::FailedPreconditionError("no unfinished copy")
                           : storage::UnfinishedCopyError(name);
  }
  if (it->second->header.provisional) {
    disk_->files_.erase(it);
    return absl::NotFoundError(absl::StrCat("map ", name, " was not completed"));
  }
  it->second->open = true;
  return std::make_unique<MemoryMap>(disk_, it->second);
}

absl::Status MemoryMapStore::Delete(const std::string& name, const std::string& request_id) {
  HYPERMAP_RETURN_IF_ERROR(ValidateName("map", name));
  MutexLock lock(&disk_->mutex_);
  const auto it = disk_->files_.find(name);
  const bool exists = it != disk_->files_.end();
  if (const auto deletion = disk_->deletions_.find(request_id);
      deletion != disk_->deletions_.end()) {
    if (deletion->second != name) return absl::InvalidArgumentError("the id deleted another map");
    if (exists) return absl::FailedPreconditionError("made since, and not deleted");
    return absl::OkStatus();
  }
  if (!exists) return absl::NotFoundError(name);
  if (it->second->open) return IsOpenError(name);
  HYPERMAP_RETURN_IF_ERROR(disk_->deletion_status_);
  disk_->files_.erase(it);
  if (!request_id.empty()) disk_->deletions_[request_id] = name;
  return absl::OkStatus();
}

absl::StatusOr<std::optional<std::string>> MemoryMapStore::FindDeletion(
    const std::string& request_id) {
  MutexLock lock(&disk_->mutex_);
  const auto it = disk_->deletions_.find(request_id);
  if (it == disk_->deletions_.end()) return std::nullopt;
  return it->second;
}

}  // namespace hypermap::server
