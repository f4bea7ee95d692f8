#include "server/backup_schedule.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <system_error>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "base/cancellation/cancellation.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"
#include "map/check_report.h"
#include "storage/sqlite/durable_file.h"

namespace hypermap::server {
namespace {

// Names of folders, which sort by their time.
constexpr char kTimeFormat[] = "%Y-%m-%dT%H%M%SZ";
// The schedule looks this often whether a backup is due, and tries a failed one again this soon.
constexpr absl::Duration kLookPeriod = absl::Seconds(10);
constexpr absl::Duration kRetryPeriod = absl::Minutes(10);

// Removes the backups that a killed server has not completed.
void RemoveLeftOver(const std::string& folder) {
  std::error_code error;
  std::filesystem::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != std::filesystem::recursive_directory_iterator();
       entry.increment(error)) {
    const std::string path = entry->path().string();
    if (absl::EndsWith(path, ".gpkg.new")) storage::RemoveFile(path).IgnoreError();
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<BackupSchedule>> BackupSchedule::Start(
    Site* site, const BackupOptions& options) {
  HYPERMAP_RETURN_IF_ERROR(storage::MakeFolder(options.folder));
  RemoveLeftOver(options.folder);
  std::unique_ptr<BackupSchedule> schedule(new BackupSchedule(site, options));
  HYPERMAP_ASSIGN_OR_RETURN(
      schedule->thread_,
      StartThread("hm-backups", [schedule = schedule.get()] { schedule->Run(); }));
  return schedule;
}

BackupSchedule::~BackupSchedule() {
  if (!thread_.joinable()) return;
  {
    const MutexLock lock(&mutex_);
    ending_ = true;
  }
  changed_.NotifyAll();
  thread_.join();
}

bool BackupSchedule::is_ending() const {
  const MutexLock lock(&mutex_);
  return ending_;
}

bool BackupSchedule::AwaitLook() {
  const MutexLock lock(&mutex_);
  if (!ending_) changed_.WaitFor(&mutex_, std::min(kLookPeriod, options_.every));
  return !ending_;
}

void BackupSchedule::Run() {
  Cancellation cancellation([this]() -> absl::Status {
    return is_ending() ? absl::CancelledError("the server stops") : absl::OkStatus();
  });
  const ScopedCancellation here(&cancellation);
  do {
    BackUpWhatIsDue();
  } while (AwaitLook());
}

void BackupSchedule::BackUpWhatIsDue() {
  for (const Site::Entry& entry : site_->List()) {
    if (is_ending()) return;
    // A map that can't be opened has a metric and an alert of its own. One that another server owns
    // is backed up by that server.
    if (!entry.session || !entry.session->CheckOwner().ok()) continue;
    const absl::Time now = site_->clock().Now();
    // Of an attempt that failed a file may have stayed, which does not count.
    const auto failed = not_before_.find(entry.name);
    const bool is_due = failed == not_before_.end() ? now - NewestOf(entry.name) >= options_.every
                                                    : now >= failed->second;
    if (!is_due) continue;
    const absl::Status status = BackUp(*entry.session, now);
    if (is_ending()) return;
    if (status.ok()) {
      not_before_.erase(entry.name);
      meters_.AddVerified(entry.name, now);
      continue;
    }
    not_before_[entry.name] = now + std::min(kRetryPeriod, options_.every);
    meters_.AddFailed(entry.name);
    logging::Log(logging::Level::kError, "a map is not backed up",
                 {{"map", entry.name}, {"problem", status.ToString()}});
  }
}

absl::Status BackupSchedule::BackUp(MapSession& session, absl::Time now) {
  const std::string& map = session.header().name;
  const std::string folder =
      absl::StrCat(options_.folder, "/", absl::FormatTime(kTimeFormat, now, absl::UTCTimeZone()));
  HYPERMAP_RETURN_IF_ERROR(storage::MakeFolder(folder));
  // Otherwise a power loss could take the folder, after older backups have gone.
  HYPERMAP_RETURN_IF_ERROR(storage::SyncFolder(options_.folder));
  const std::string temporary = absl::StrCat(folder, "/.", map, ".gpkg.new");
  absl::Status status =
      session.BackupTo(temporary, [](int64_t /*most_bytes*/) { return absl::OkStatus(); });
  if (status.ok()) {
    const absl::StatusOr<CheckReport> report = site_->CheckFile(temporary);
    status = report.status();
    if (report.ok() && !report->is_clean()) {
      status = absl::DataLossError(absl::StrCat("the backup is damaged, and is not kept: ",
                                                Describe(report->findings.front())));
    }
  }
  if (status.ok()) {
    status = storage::PublishFile(temporary, absl::StrCat(folder, "/", map, ".gpkg"));
  }
  if (status.ok()) return RemoveOld(map);
  storage::RemoveFile(temporary).IgnoreError();
  std::error_code ignored;
  std::filesystem::remove(folder, ignored);  // if it is empty
  return status;
}

std::vector<std::string> BackupSchedule::BackupsOf(const std::string& map) const {
  std::vector<std::string> folders;
  std::error_code error;
  std::filesystem::directory_iterator entry(options_.folder, error);
  for (; !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    absl::Time time;
    const std::string name = entry->path().filename().string();
    if (!absl::ParseTime(kTimeFormat, name, &time, nullptr)) continue;
    if (storage::PathExists(absl::StrCat(entry->path().string(), "/", map, ".gpkg"))) {
      folders.push_back(name);
    }
  }
  std::sort(folders.begin(), folders.end(), std::greater<>());
  return folders;
}

absl::Time BackupSchedule::NewestOf(const std::string& map) const {
  absl::Time time = absl::InfinitePast();
  const std::vector<std::string> folders = BackupsOf(map);
  if (!folders.empty()) absl::ParseTime(kTimeFormat, folders.front(), &time, nullptr);
  return time;
}

absl::Status BackupSchedule::RemoveOld(const std::string& map) const {
  const std::vector<std::string> folders = BackupsOf(map);
  for (size_t i = static_cast<size_t>(options_.keep); i < folders.size(); ++i) {
    const std::string folder = absl::StrCat(options_.folder, "/", folders[i]);
    HYPERMAP_RETURN_IF_ERROR(storage::RemoveFile(absl::StrCat(folder, "/", map, ".gpkg")));
    std::error_code ignored;
    std::filesystem::remove(folder, ignored);  // if it was the last
  }
  return absl::OkStatus();
}

}  // namespace hypermap::server
