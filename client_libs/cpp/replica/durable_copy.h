// The file of a replica.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::client {

// A revision of a server's map. The incarnation and the times distinguish it from a revision with
// the same number of another map, or of a restored one.
struct KnownRevision {
  SnapshotPtr snapshot;
  absl::Time time;           // when the revision was made
  absl::Time created_at;     // when the map was created
  uint64_t incarnation = 0;  // of the map; 0: the server reports none
};

// Keeps a map in FOLDER/<map>.gpkg, in a store of its own. A thread writes the newest revision
// after a delay, as one transaction with the difference from the revision on disk, so that repeated
// changes of an object are written once. If no difference leads from the map on disk to the new
// one, the file is replaced: the new one is written to FOLDER/next.gpkg before, so that at every
// moment, also after a crash, one of the two can be read. Thread safe.
class DurableCopy {
 public:
  // Opens or creates the file. `selection` describes the mirrored part of the map: a file with
  // another selection is deleted, and a damaged file is renamed to <map>.gpkg.damaged.
  // FAILED_PRECONDITION if the folder is in use or the file is not a replica's.
  static absl::StatusOr<std::unique_ptr<DurableCopy>> Open(const std::string& folder,
                                                           const std::string& map,
                                                           const std::string& selection,
                                                           absl::Duration write_delay);
  // Writes the newest revision given to Write.
  ~DurableCopy();
  DurableCopy(const DurableCopy&) = delete;
  DurableCopy& operator=(const DurableCopy&) = delete;

  // The revision on disk; nullopt if there is none.
  std::optional<KnownRevision> stored() const;
  // Reason why the last write failed, or why the history before it could not be deleted; both are
  // retried. OK if nothing failed.
  absl::Status problem() const;

  // Schedules a revision to be written; does not wait. If it differs from the stored one only in
  // its number, it is written by Flush or the destructor.
  void Write(KnownRevision newest);
  // Writes the newest revision now. OK if it is on disk, even if the history before it could not be
  // deleted.
  absl::Status Flush();

 private:
  DurableCopy(std::unique_ptr<storage::MapStore> store, std::string map, std::string selection,
              absl::Duration write_delay);

  // Opens and reads the existing file, if it can be continued.
  absl::Status Load(const std::string& folder);
  // Takes over what an interrupted replacement has left, if there is no file.
  absl::Status LoadNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(file_mutex_);
  absl::Status ReadStored() ABSL_EXCLUSIVE_LOCKS_REQUIRED(file_mutex_);

  // Body of the writer's thread.
  void Run();
  // Waits until a revision has to be written and the delay has passed. Returns false if the copy is
  // being destroyed.
  bool AwaitDue();
  // Waits for the delay, or until the copy is being destroyed.
  void Delay() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Writes the newest revision and deletes the history before it. `all`: also if only the number
  // differs. Returns OK if the file has the revision, with or without history.
  absl::Status WriteNow(bool all);
  // Brings the file from `before` to `after`. Returns false if the file was left as it is.
  absl::StatusOr<bool> Store(const std::optional<KnownRevision>& before, const KnownRevision& after,
                             bool all) ABSL_EXCLUSIVE_LOCKS_REQUIRED(file_mutex_);
  // Creates the file anew. If that fails, the file is as it was, or there is none.
  absl::Status Replace(const KnownRevision& newest) ABSL_EXCLUSIVE_LOCKS_REQUIRED(file_mutex_);
  // Creates a map of the store that holds the revision. After an error there is none.
  absl::StatusOr<std::unique_ptr<storage::StoredMap>> Make(const std::string& name,
                                                           const KnownRevision& revision);
  // Removes a map of the store, if there is one.
  absl::Status RemoveMap(const std::string& name);
  // The name of the map to which a new file is written before the old one is removed.
  std::string next_name() const { return map_ == "next" ? "next.2" : "next"; }
  // Deletes the history, which a replica never reads. If the file turns out to be lost, there is no
  // file afterwards.
  absl::Status ForgetThePast() ABSL_EXCLUSIVE_LOCKS_REQUIRED(file_mutex_);

  const std::unique_ptr<storage::MapStore> store_;
  const std::string map_;
  const std::string selection_;
  const absl::Duration write_delay_;

  // Held while the file is used. Locked before mutex_.
  Mutex file_mutex_;
  // Null if there is no file.
  std::unique_ptr<storage::StoredMap> file_ ABSL_GUARDED_BY(file_mutex_);
  // The revision of the file, if the history before it is still to be deleted.
  std::optional<Revision> forget_before_ ABSL_GUARDED_BY(file_mutex_);

  mutable Mutex mutex_;
  CondVar changed_;
  std::optional<KnownRevision> stored_ ABSL_GUARDED_BY(mutex_);
  std::optional<KnownRevision> newest_ ABSL_GUARDED_BY(mutex_);  // the last argument of Write
  bool is_due_ ABSL_GUARDED_BY(mutex_) = false;                  // newest_ has to be written
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status problem_ ABSL_GUARDED_BY(mutex_);

  std::thread writer_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_
