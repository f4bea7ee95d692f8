// The file of an outbox, shared by the threads that put entries and the threads that send them.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_QUEUE_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_QUEUE_H_

#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// Thread safe.
class OutboxQueue {
 public:
  explicit OutboxQueue(std::unique_ptr<storage::OutboxFile> file) : file_(std::move(file)) {}

  // Calls `use` with exclusive access to the file, then wakes all waiting threads.
  template <typename Use>
  auto With(Use use) {
    const MutexLock lock(&mutex_);
    auto result = use(*file_);
    changed_.NotifyAll();
    return result;
  }

  // Returns the first `limit` entries of a stream, waiting until there is one. Empty if the queue
  // is closed.
  absl::StatusOr<std::vector<storage::QueuedRequest>> AwaitFirst(int64_t stream, int limit);
  // Waits until no stream has an entry. Returns false at `deadline`.
  absl::StatusOr<bool> AwaitEmpty(const Deadline& deadline);

  // Sets the reason why a stream is not delivered; OK if there is none.
  void NoteProblem(int64_t stream, absl::Status problem);
  // Returns the problem of some stream; OK if no stream has one.
  absl::Status problem() const;

  // Waits. Returns false if the queue was closed meanwhile.
  bool Sleep(absl::Duration duration);
  // Ends all waiting for entries.
  void Close();

 private:
  mutable Mutex mutex_;
  CondVar changed_;
  const std::unique_ptr<storage::OutboxFile> file_ ABSL_PT_GUARDED_BY(mutex_);
  // The streams whose status is not OK.
  std::map<int64_t, absl::Status> problems_ ABSL_GUARDED_BY(mutex_);
  bool closed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_QUEUE_H_
