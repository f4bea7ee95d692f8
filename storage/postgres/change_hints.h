// Tells the other servers that use a database when a map has a new revision, and hears it of them.
#ifndef HYPERMAP_STORAGE_POSTGRES_CHANGE_HINTS_H_
#define HYPERMAP_STORAGE_POSTGRES_CHANGE_HINTS_H_

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "storage/libpq/connection.h"

namespace hypermap::storage::postgres {

// Hints go by NOTIFY, on connections of their own: a commit does not wait for them, and does not
// take the lock that PostgreSQL has for all notifications. Those of many maps, and those of a few
// milliseconds, go together. What could not be sent is sent again; a server whose own connection
// was lost hears of everything once (a hint without a map). Thread safe.
class ChangeHints {
 public:
  // Called with the name of a map, or an empty one when anything may have changed. Also for this
  // server's own hints.
  using Heard = std::function<void(const std::string& map)>;

  // Starts to listen. `options` must be those of direct connections to the primary. Without threads
  // for it, no hints are told or heard.
  static std::unique_ptr<ChangeHints> Start(ConnectOptions options);
  ~ChangeHints();
  ChangeHints(const ChangeHints&) = delete;
  ChangeHints& operator=(const ChangeHints&) = delete;

  // From now on calls `heard`, one call at a time; null: nothing.
  void Listen(Heard heard);

  // Tells all servers that the map has changed, soon. An empty name: anything may have.
  void Announce(const std::string& map);

 private:
  explicit ChangeHints(ConnectOptions options) : options_(std::move(options)) {}
  void SendUntilStopped();
  void ListenUntilStopped();
  // Returns the maps to announce; empty when this is stopping.
  std::set<std::string> AwaitAnnouncements();
  absl::Status Send(const std::set<std::string>& maps);
  // Waits for one hint, or a short time.
  absl::Status ListenForAWhile();
  // Opens a connection if there is none that works; returns whether it is a new one.
  absl::StatusOr<bool> Reconnect(std::unique_ptr<Connection>* connection) const;
  // Returns whether to go on.
  bool PauseAfterFailure();
  void Tell(const std::string& map);

  const ConnectOptions options_;
  Mutex mutex_;
  CondVar changed_;
  std::set<std::string> announced_ ABSL_GUARDED_BY(mutex_);
  bool is_stopping_ ABSL_GUARDED_BY(mutex_) = false;
  Mutex heard_mutex_;  // held while heard_ runs
  Heard heard_ ABSL_GUARDED_BY(heard_mutex_);
  std::unique_ptr<Connection> sender_connection_;    // used by sender_
  std::unique_ptr<Connection> listener_connection_;  // used by listener_
  std::thread sender_;
  std::thread listener_;
};

}  // namespace hypermap::storage::postgres

#endif  // HYPERMAP_STORAGE_POSTGRES_CHANGE_HINTS_H_
