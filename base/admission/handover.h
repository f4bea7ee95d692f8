// Gives accepted connections to gRPC.
#ifndef HYPERMAP_BASE_ADMISSION_HANDOVER_H_
#define HYPERMAP_BASE_ADMISSION_HANDOVER_H_

#include <deque>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "base/admission/listening_socket.h"
#include "base/sync/mutex.h"

namespace hypermap::admission {

// Gives connections to gRPC in their order, on threads of its own. gRPC reads from a connection on
// the thread that gives it, until nothing waits: a client that sends faster than gRPC reads keeps
// that thread for as long as it likes. The thread that looks for such clients must not be it.
//
// There is one thread at first, and up to kMaxThreads when connections wait. Thread safe.
class Handover {
 public:
  static constexpr int kMaxThreads = 8;
  // Time that gRPC has at the end to read what has come.
  static constexpr absl::Duration kGrace = absl::Seconds(1);

  // RESOURCE_EXHAUSTED if no thread can be started.
  static absl::StatusOr<std::unique_ptr<Handover>> Start(
      std::function<void(FileDescriptor socket)> accept);
  // Closes the connections that wait, shuts down those that are still being given after kGrace, and
  // waits for the threads.
  ~Handover();
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  void Give(FileDescriptor socket);

  // Starts another thread if connections have waited since the last call. To be called every few
  // milliseconds.
  void Attend();

 private:
  explicit Handover(std::function<void(FileDescriptor socket)> accept);

  bool StartOne() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Run();

  const std::function<void(FileDescriptor socket)> accept_;
  // The scheduling priority of the threads.
  const int niceness_;
  Mutex mutex_;
  CondVar changed_;
  CondVar was_given_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  bool waited_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<FileDescriptor> waiting_ ABSL_GUARDED_BY(mutex_);
  // Duplicates of the sockets that are being given.
  absl::flat_hash_set<int> given_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::thread> threads_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_HANDOVER_H_
