// Backups that a server makes by itself.
#ifndef HYPERMAP_SERVER_BACKUP_SCHEDULE_H_
#define HYPERMAP_SERVER_BACKUP_SCHEDULE_H_

#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "server/session/backup_meters.h"
#include "server/session/site.h"

namespace hypermap::server {

struct BackupOptions {
  std::string folder;
  absl::Duration every;
  int keep = 1;  // verified backups of each map; at least 1
};

// Backs up each map when its newest backup is old enough, one after another, on a thread of its
// own:
//
//   FOLDER/<UTC time>/<map>.gpkg        a backup that was checked and found to be clean
//   FOLDER/<UTC time>/.<map>.gpkg.new   one that is being written or checked
//
// Older backups of a map are removed only after a newer one was verified, so that a map that is
// damaged keeps those from before. A failure is logged and counted, and tried again later. Thread
// safe.
class BackupSchedule {
 public:
  // The first backups are made at once, if none is new enough. `site` must outlive this.
  // FAILED_PRECONDITION if the folder can't be made.
  static absl::StatusOr<std::unique_ptr<BackupSchedule>> Start(Site* site,
                                                               const BackupOptions& options);
  // Gives up the backup under way.
  ~BackupSchedule();
  BackupSchedule(const BackupSchedule&) = delete;
  BackupSchedule& operator=(const BackupSchedule&) = delete;

  const BackupMeters& meters() const { return meters_; }

 private:
  BackupSchedule(Site* site, const BackupOptions& options) : site_(site), options_(options) {}

  void Run();
  // Waits for the next look; false if the schedule ends.
  bool AwaitLook();
  bool is_ending() const;
  void BackUpWhatIsDue();
  absl::Status BackUp(MapSession& session, absl::Time now);
  // The folders of FOLDER that have a backup of the map, the newest first.
  std::vector<std::string> BackupsOf(const std::string& map) const;
  absl::Time NewestOf(const std::string& map) const;
  absl::Status RemoveOld(const std::string& map) const;

  Site* const site_;
  const BackupOptions options_;
  BackupMeters meters_;
  // Used by the thread only: maps whose last backup failed, and when it is tried again.
  std::map<std::string, absl::Time> not_before_;

  mutable Mutex mutex_;
  CondVar changed_;
  bool ending_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_BACKUP_SCHEDULE_H_
