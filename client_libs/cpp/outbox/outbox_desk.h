// The file of an outbox, shared by the threads that put entries and the threads that send them.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DESK_H_
#define HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DESK_H_

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "storage/outbox/outbox_file.h"

namespace hypermap::client {

// Thread safe.
class OutboxDesk {
 public:
  explicit OutboxDesk(std::unique_ptr<storage::OutboxFile> file) : file_(std::move(file)) {}

  // Calls `use` with exclusive access to the file, then wakes all waiting threads.
  template <typename Use>
  auto With(Use use) {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto result = use(*file_);
    changed_.notify_all();
    return result;
  }

  // Returns the first `limit` entries of a stream, waiting until there is one. Empty if the desk is
  // closed.
  absl::StatusOr<std::vector<storage::Letter>> AwaitFirst(int64_t stream, int limit);
  // Waits until no stream has an entry. Returns false at `deadline`.
  absl::StatusOr<bool> AwaitEmpty(absl::Time deadline);

  // Sets the reason why a stream is not delivered; OK if there is none.
  void NoteProblem(int64_t stream, absl::Status problem);
  // Returns the problem of some stream; OK if no stream has one.
  absl::Status problem() const;

  // Waits. Returns false if the desk was closed meanwhile.
  bool Sleep(absl::Duration duration);
  // Ends all waiting for entries.
  void Close();

 private:
  // Not absl::Mutex, which ThreadSanitizer does not understand unless abseil is built with it.
  mutable std::mutex mutex_;  // guards all members below
  std::condition_variable changed_;
  const std::unique_ptr<storage::OutboxFile> file_;
  std::map<int64_t, absl::Status> problems_;  // the streams whose status is not OK
  bool closed_ = false;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DESK_H_
