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

// A revision of a server's map, and what tells it from another one of the same number.
struct KnownRevision {
  SnapshotPtr snapshot;
  absl::Time time;        // when it was made
  absl::Time created_at;  // when the map was made
};

// Keeps a map in FOLDER/<map>.gpkg, a store of its own. What it is given is written some time later
// by a thread of its own, in one transaction: the difference to what is on disk, so that what
// changed several times is written once. A map that no changes lead to from the one on disk takes
// its place. Thread safe.
class DurableCopy {
 public:
  // `selection` says what of the map is kept: a file with another selection is removed, a damaged
  // one put aside as <map>.gpkg.damaged. FAILED_PRECONDITION when the folder is in use, or the file
  // is not a replica's.
  static absl::StatusOr<std::unique_ptr<DurableCopy>> Open(const std::string& folder,
                                                           const std::string& map,
                                                           const std::string& selection,
                                                           absl::Duration write_delay);
  // Writes what it was given last.
  ~DurableCopy();
  DurableCopy(const DurableCopy&) = delete;
  DurableCopy& operator=(const DurableCopy&) = delete;

  // What is on disk; nullopt: nothing.
  std::optional<KnownRevision> stored() const;
  // Why the last writing failed; it is tried again.
  absl::Status problem() const;

  // Has it written in due time; does not wait. A revision that is like the stored one but for its
  // number is written at the end only.
  void Write(KnownRevision newest);
  // Writes what was given last, and waits for it.
  absl::Status Flush();

 private:
  DurableCopy(std::unique_ptr<storage::MapStore> store, std::string map, std::string selection,
              absl::Duration write_delay);

  // Opens the file that is there, if it is one to go on with, and reads it.
  absl::Status Load(const std::string& folder);
  absl::Status ReadStored();

  // The writer's thread.
  void Run();
  // Writes what was given last; `all`: also where only the number is another.
  absl::Status WriteNow(bool all);
  // Brings the file from `before` to `after`; false when it was left as it is.
  absl::StatusOr<bool> Store(const std::optional<KnownRevision>& before, const KnownRevision& after,
                             bool all);
  // Makes the file anew; there is none when that fails.
  absl::Status Replace(const KnownRevision& newest);

  const std::unique_ptr<storage::MapStore> store_;
  const std::string map_;
  const std::string selection_;
  const absl::Duration write_delay_;

  // Held while the file is used; taken before the other.
  std::mutex file_mutex_;
  std::unique_ptr<storage::StoredMap> file_;  // null: there is none

  // Guards all that follows. Not absl::Mutex, which ThreadSanitizer can't see unless abseil is
  // built with it.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<KnownRevision> stored_;
  std::optional<KnownRevision> newest_;  // what it was given last
  bool is_due_ = false;                  // there is something to write
  bool closing_ = false;
  absl::Status problem_;

  std::thread writer_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_DURABLE_COPY_H_
