// A MapStore in memory, for tests, whose writes can be made to fail or to wait.
#ifndef HYPERMAP_SERVER_SESSION_TESTING_MEMORY_MAP_STORE_H_
#define HYPERMAP_SERVER_SESSION_TESTING_MEMORY_MAP_STORE_H_

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/sync/mutex.h"
#include "server/fusion/testing/memory_fusion_log.h"
#include "server/session/testing/memory_history.h"
#include "storage/map_store.h"

namespace hypermap::server {

// The storage behind MemoryMapStore, with which tests delay, fail and count writes. Thread safe.
class MemoryDisk {
  struct File;

 public:
  // Makes writes wait until Release.
  void Hold();
  void Release();
  // Returns when a write waits.
  void AwaitHeldWrite();
  // Makes all writes fail with `status`; OK makes them work again.
  void FailWrites(absl::Status status);
  // Makes all writes and StoredMap::CheckFile fail with `status`, as if the files were replaced.
  void BreakFiles(const absl::Status& status);
  // Makes all creations of maps fail with `status` after the map was made, as if it could be
  // neither opened nor removed.
  void FailCreationsLate(absl::Status status);
  // Makes all deletions of maps fail with `status`.
  void FailDeletions(absl::Status status);
  // What a shared store tells of the newest revisions of its maps. Reads of them wait until
  // ReleaseNewest, and then tell what is stored by then.
  void HoldNewest();
  void ReleaseNewest();
  // Returns when such a read waits.
  void AwaitHeldNewest();
  // Makes these reads fail with `status`; OK makes them work again.
  void FailNewest(absl::Status status);
  // Makes them tell another revision of a map than this server's, as if another had written it.
  void TellNewest(const std::string& map, storage::NewestRevision newest);
  // The names in each such read.
  std::vector<std::vector<std::string>> newest_reads() const;
  // The maps and deletions at one moment. Cheap to copy.
  struct Image {
    std::map<std::string, std::shared_ptr<const File>> files;
    std::map<std::string, std::string> deletions;
  };
  Image Save() const;
  // Makes the maps those of an image, as a crash leaves them. Maps that were open before see and
  // write files that nobody else has any more.
  void Restore(const Image& image);
  // The number of commits in each successful write.
  std::vector<size_t> writes() const;

 private:
  friend class MemoryMap;
  friend class MemoryMapStore;

  struct File {
    storage::MapHeader header;
    SnapshotPtr snapshot;
    std::map<std::string, storage::TimedReceipt, std::less<>> receipts;
    MemoryFusionLog fusion;
    std::shared_ptr<MemoryHistory> history = std::make_shared<MemoryHistory>();
    std::vector<storage::TimeMark> marks;
    bool open = false;
    absl::Status problem;
  };

  // ALREADY_EXISTS if the map has a receipt for one of the commits' requests.
  static absl::Status CheckRequests(const File& file, absl::Span<const storage::Commit> commits);
  absl::Status Write(File& file, absl::Span<const storage::Commit> commits);
  absl::Status AddTimeMark(File& file, const storage::TimeMark& mark, absl::Duration forget_before);

  mutable Mutex mutex_;
  CondVar changed_;
  bool held_ ABSL_GUARDED_BY(mutex_) = false;
  int waiting_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status write_status_ ABSL_GUARDED_BY(mutex_);
  absl::Status file_status_ ABSL_GUARDED_BY(mutex_);
  absl::Status creation_status_ ABSL_GUARDED_BY(mutex_);
  absl::Status deletion_status_ ABSL_GUARDED_BY(mutex_);
  bool newest_held_ ABSL_GUARDED_BY(mutex_) = false;
  int newest_waiting_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status newest_status_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, storage::NewestRevision> newest_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::vector<std::string>> newest_reads_ ABSL_GUARDED_BY(mutex_);
  std::vector<size_t> writes_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<File>> files_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::string> deletions_ ABSL_GUARDED_BY(mutex_);
};

// A store on a MemoryDisk. Stores on the same disk see the same maps, so that a test can restart
// the server.
class MemoryMapStore : public storage::MapStore {
 public:
  // `disk` must outlive the store and its maps. With the id of a server the store can be shared,
  // and this server owns all of its maps.
  explicit MemoryMapStore(MemoryDisk* disk, std::string server_id = "")
      : disk_(disk), server_id_(std::move(server_id)) {}

  // Adds a map that can't be opened, or sets the problem of one that was added; OK: it can be.
  void AddBroken(const std::string& name, absl::Status problem);

  // The attempts to open a map so far.
  int num_openings() const { return num_openings_; }

  std::string server_id() const override { return server_id_; }
  absl::StatusOr<storage::Survey> TakeSurvey() override;
  absl::StatusOr<std::map<std::string, storage::NewestRevision>> NewestRevisions(
      const std::vector<std::string>& names) override;
  absl::StatusOr<std::vector<std::string>> List() override;
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Create(
      const storage::MapHeader& header) override;
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Open(const std::string& name) override;
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> OpenUnfinishedCopy(
      const std::string& name) override;
  std::string FileStamp(const std::string& name) override;
  absl::Status Delete(const std::string& name, const std::string& request_id) override;
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override;

 private:
  static std::shared_ptr<MemoryDisk::File> MakeFile(const storage::MapHeader& header);
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> OpenAs(const std::string& name,
                                                             bool unfinished_copy);

  MemoryDisk* const disk_;
  const std::string server_id_;
  std::atomic<int> num_openings_ = 0;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_TESTING_MEMORY_MAP_STORE_H_
