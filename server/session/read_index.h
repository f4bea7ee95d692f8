// Finds out which revisions a linearizable question must show.
#ifndef HYPERMAP_SERVER_SESSION_READ_INDEX_H_
#define HYPERMAP_SERVER_SESSION_READ_INDEX_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/executor.h"
#include "base/sync/mutex.h"
#include "storage/map_store.h"

namespace hypermap::server {

// Reads the newest revisions of maps from a store that several servers share (the read index of
// Raft, section 6.4 of Ongaro's thesis). A loop asks the store for all questions that wait, in one
// read, and never twice at the same time: a read that was begun before a question came does not
// count for it. Thread safe.
class ReadIndex {
 public:
  // NOT_FOUND if there is no such map in the store; UNAVAILABLE.
  using Callback = absl::AnyInvocable<void(const absl::StatusOr<storage::NewestRevision>&) &&>;

  // `store` and `executor` must outlive this.
  static absl::StatusOr<std::unique_ptr<ReadIndex>> Start(storage::MapStore* store,
                                                          Executor* executor);
  // Calls Close.
  ~ReadIndex();

  // Calls `done` once, on the thread of the loop, or on this one once this is closed. `done` must
  // not wait.
  void Ask(const std::string& map, Callback done);

  // Answers what waits with UNAVAILABLE, and returns when the loop has ended.
  void Close();

 private:
  struct Question {
    std::string map;
    Callback done;
  };

  explicit ReadIndex(storage::MapStore* store) : store_(store) {}

  // A step of the loop: answers the questions that wait.
  std::optional<absl::Duration> Step();
  void Answer(std::vector<Question> questions);

  storage::MapStore* const store_;
  Mutex mutex_;
  std::vector<Question> waiting_ ABSL_GUARDED_BY(mutex_);
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
  // Set before anybody but Start has this.
  std::unique_ptr<Executor::Running> loop_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_READ_INDEX_H_
