// Keeps a replica up to date with its server.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_H_

#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "client_libs/cpp/replica/feed_cursor.h"
#include "client_libs/cpp/replica/replica.h"

namespace hypermap::client {

// Follows a map (Client::Replicate) and resumes after breaks of the connection: from the last
// revision that it has, or from a snapshot if the server does not know that revision. Runs on its
// own thread from Start on. Thread safe.
class Feed {
 public:
  struct Standing {
    bool connected = false;
    absl::Time newest_at = absl::InfinitePast();
    absl::Status problem;  // reason why it is not connected
    int num_resumed = 0;
    int num_taken_anew = 0;
  };

  // `known`: the revision to resume from, if any. `take` is called for each revision, in order.
  Feed(Client client, const ReplicaOptions& options, std::optional<KnownRevision> known,
       std::function<void(const KnownRevision&)> take);
  // Stops the thread.
  ~Feed();
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  // Must be called once.
  void Start();
  Standing standing() const;
  // Fetches the map again, as the copy is not what the server has.
  void TakeAnew();
  // Waits until the first attempt has delivered a revision or failed.
  void AwaitFirst() const;

 private:
  void Run();
  // Runs one call to its end, and returns the reason for that.
  absl::Status Follow();
  bool MustTakeAnew() const;
  absl::Status Take(const WatchEvent& event);
  void NoteEvent(const FeedCursor::Step& step);
  void NoteEnd(const absl::Status& why);
  // Returns false if the feed is being destroyed.
  bool Sleep(absl::Duration pause);

  Client client_;
  const ReplicaOptions options_;
  const std::function<void(const KnownRevision&)> take_;

  // Used by the feed's thread only.
  FeedCursor cursor_;
  absl::Time opened_at_;  // when the current call was opened

  mutable Mutex mutex_;
  mutable CondVar changed_;
  Standing standing_ ABSL_GUARDED_BY(mutex_);
  // The first attempt has delivered a revision or failed.
  bool tried_ ABSL_GUARDED_BY(mutex_) = false;
  // TakeAnew was called, and no snapshot has come since.
  bool must_take_anew_ ABSL_GUARDED_BY(mutex_) = false;
  Watcher* watcher_ ABSL_GUARDED_BY(mutex_) = nullptr;  // of the current call
  bool closing_ ABSL_GUARDED_BY(mutex_) = false;

  std::thread thread_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_H_
