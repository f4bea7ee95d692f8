// What keeps a replica up with its server.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_H_
#define HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_H_

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"
#include "client_libs/cpp/replica/durable_copy.h"
#include "client_libs/cpp/replica/replica.h"

namespace hypermap::client {

// Follows a map, revision after revision, through breaks of the connection: it goes on after the
// last revision that it has, and begins with a snapshot where the server does not know that one.
// Runs on a thread of its own from Start on. Thread safe.
class Feed {
 public:
  struct Standing {
    bool connected = false;
    absl::Time newest_at = absl::InfinitePast();
    absl::Status problem;  // why it is not connected
    int num_resumed = 0;
    int num_taken_anew = 0;
  };

  // `known`: to go on from, if there is something. `take` is called with each revision, in order.
  Feed(Client client, const ReplicaOptions& options, std::optional<KnownRevision> known,
       std::function<void(const KnownRevision&)> take);
  // Ends.
  ~Feed();
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  // Once.
  void Start();
  Standing standing() const;
  // Waits until the first try has told something, or failed.
  void AwaitFirst() const;

 private:
  void Run();
  // One call, until it ends: why.
  absl::Status Follow();
  absl::Status Take(const WatchEvent& event, bool is_first);
  WatchOptions OptionsToGoOn() const;
  void NoteEvent(const WatchEvent& event, bool is_first, bool had_another);
  void NoteEnd(const absl::Status& why);
  // False when the feed ends.
  bool Sleep(absl::Duration pause);

  Client client_;
  const ReplicaOptions options_;
  const std::function<void(const KnownRevision&)> take_;

  // Of the feed's thread.
  std::optional<KnownRevision> known_;
  bool starts_anew_ = false;     // the server does not know known_
  absl::Time opened_at_;         // the call
  Revision newest_at_open_ = 0;  // the map's

  // Guards all that follows. Not absl::Mutex: see DurableCopy.
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  Standing standing_;
  bool tried_ = false;          // the first try has told something, or failed
  Watcher* watcher_ = nullptr;  // of the call under way
  bool closing_ = false;

  std::thread thread_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_REPLICA_FEED_H_
