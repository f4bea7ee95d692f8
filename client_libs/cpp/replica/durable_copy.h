// The file of a replica.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "map/snapshot.h"
#include "storage/map_store.h"

namespace hypermap::client {

// A revision of a server's map. The times distinguish it from a revision with the same number of
// another map, or of a restored one.
struct KnownRevision {
  SnapshotPtr snapshot;
  absl::Time time;        // when the revision was made
  absl::Time created_at;  // when the map was created
};

// Keeps a map in FOLDER/<map>.gpkg, in a store of its own. A thread writes the newest revision
// after a delay, as one transaction with the difference from the revision on disk, so that repeated
// changes of an object are written once. If no difference leads from the map on disk to the new
// one, the file is replaced. Thread safe.
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
  // Reason why the last write failed; it is retried. OK if it did not fail.
  absl::Status problem() const;

  // Schedules a revision to be written; does not wait. If it differs from the stored one only in
  // its number, it is written by Flush or the destructor.
  void Write(KnownRevision newest);
  // Writes the newest revision now.
  absl::Status Flush();

 private:
  DurableCopy(std::unique_ptr<storage::MapStore> store, std::string map, std::string selection,
              absl::Duration write_delay);

  // Opens and reads the existing file, if it can be continued.
  absl::Status Load(const std::string& folder);
  absl::Status ReadStored();

  // Body of the writer's thread.
  void Run();
  // Writes the newest revision. `all`: also if only the number differs.
  absl::Status WriteNow(bool all);
  // Brings the file from `before` to `after`. Returns false if the file was left as it is.
  absl::StatusOr<bool> Store(const std::optional<KnownRevision>& before, const KnownRevision& after,
                             bool all);
  // Creates the file anew. If that fails, there is no file.
  absl::Status Replace(const KnownRevision& newest);

  const std::unique_ptr<storage::MapStore> store_;
  const std::string map_;
  const std::string selection_;
  const absl::Duration write_delay_;

  // Held while the file is used. Locked before mutex_.
  std::mutex file_mutex_;
  std::unique_ptr<storage::StoredMap> file_;  // null if there is no file

  // Guards all members below. Not absl::Mutex, which ThreadSanitizer does not understand unless
  // abseil is built with it.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<KnownRevision> stored_;
  std::optional<KnownRevision> newest_;  // the last argument of Write
  bool is_due_ = false;                  // newest_ has to be written
  bool closing_ = false;
  absl::Status problem_;

  std::thread writer_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_
