// The file of an outbox, shared by those who put in and those who send.
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

  // Has `use` work with the file, alone; who waits looks again afterwards.
  template <typename Use>
  auto With(Use use) {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto result = use(*file_);
    changed_.notify_all();
    return result;
  }

  // The first letters of a stream; waits until there is one. None when the desk is closed.
  absl::StatusOr<std::vector<storage::Letter>> AwaitFirst(int64_t stream, int limit);
  // Waits until no stream has a letter; false when that is not so at `deadline`.
  absl::StatusOr<bool> AwaitEmpty(absl::Time deadline);

  // What is in the way of a stream; OK: nothing.
  void NoteProblem(int64_t stream, absl::Status problem);
  // One that is in the way of some stream.
  absl::Status problem() const;

  // Waits; false when the desk was closed meanwhile.
  bool Sleep(absl::Duration duration);
  // Ends all waiting for letters.
  void Close();

 private:
  // Not absl::Mutex, which ThreadSanitizer can't see unless abseil is built with it.
  mutable std::mutex mutex_;  // guards all that follows
  std::condition_variable changed_;
  const std::unique_ptr<storage::OutboxFile> file_;
  std::map<int64_t, absl::Status> problems_;  // those that are not OK, by stream
  bool closed_ = false;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_OUTBOX_OUTBOX_DESK_H_
