// A MapStore in memory, for tests: its disk can fail and can be made to wait.
#ifndef HYPERMAP_SERVER_SESSION_TESTING_MEMORY_MAP_STORE_H_
#define HYPERMAP_SERVER_SESSION_TESTING_MEMORY_MAP_STORE_H_

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/sync/mutex.h"
#include "server/fusion/testing/memory_fusion_log.h"
#include "server/session/testing/memory_history.h"
#include "storage/map_store.h"

namespace hypermap::server {

// What tests may do to the disk, and see of it. Thread safe.
class MemoryDisk {
 public:
  // Writes wait from now on until Release.
  void Hold();
  void Release();
  // Returns when a write has begun to wait.
  void AwaitHeldWrite();
  // What the next writes answer, instead of being carried out; OK ends that.
  void FailWrites(absl::Status status);
  // The number of batches in each write that was carried out.
  std::vector<size_t> writes() const;

 private:
  friend class MemoryMap;
  friend class MemoryMapStore;

  struct File {
    storage::MapHeader header;
    SnapshotPtr snapshot;
    struct TimedReceipt {
      storage::Receipt receipt;
      absl::Time time;
    };
    std::map<std::string, TimedReceipt, std::less<>> receipts;
    MemoryFusionLog fusion;
    std::shared_ptr<MemoryHistory> history = std::make_shared<MemoryHistory>();
    bool open = false;
    absl::Status problem;
  };

  absl::Status Write(File& file, absl::Span<const storage::Commit> commits);

  mutable Mutex mutex_;
  CondVar changed_;
  bool held_ ABSL_GUARDED_BY(mutex_) = false;
  int waiting_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status write_status_ ABSL_GUARDED_BY(mutex_);
  std::vector<size_t> writes_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::shared_ptr<File>> files_ ABSL_GUARDED_BY(mutex_);
  std::map<std::string, std::string> deletions_ ABSL_GUARDED_BY(mutex_);
};

// Stores on one disk see the same maps, as a server that starts again does.
class MemoryMapStore : public storage::MapStore {
 public:
  // `disk` must outlive the store and its maps.
  explicit MemoryMapStore(MemoryDisk* disk) : disk_(disk) {}

  // Makes a map that can't be opened.
  void AddBroken(const std::string& name, absl::Status problem);

  absl::StatusOr<std::vector<std::string>> List() override;
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Create(
      const storage::MapHeader& header) override;
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Open(const std::string& name) override;
  absl::Status Delete(const std::string& name, const std::string& request_id) override;
  absl::StatusOr<std::optional<std::string>> FindDeletion(const std::string& request_id) override;

 private:
  MemoryDisk* const disk_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_TESTING_MEMORY_MAP_STORE_H_
