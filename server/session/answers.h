// Gives the answers of written groups to their callers while the writers go on.
#ifndef HYPERMAP_SERVER_SESSION_ANSWERS_H_
#define HYPERMAP_SERVER_SESSION_ANSWERS_H_

#include <cstdint>
#include <deque>
#include <memory>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/functional/any_invocable.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"

namespace hypermap::server {

// A thread for the answers of all maps. An answer takes some 20 microseconds, which is sent by the
// thread that gives it; the answers of a large group take about as long as writing the next one.
// Thread safe.
class Answers {
 public:
  // Gives the answers of a group.
  using Give = absl::AnyInvocable<void() &&>;

  // RESOURCE_EXHAUSTED if there is no thread for it.
  static absl::StatusOr<std::unique_ptr<Answers>> Start();
  // Waits for all that were added.
  ~Answers();
  Answers(const Answers&) = delete;
  Answers& operator=(const Answers&) = delete;

  // Has `give` called soon, after those that were added before it.
  void Add(Give give);
  // Returns when all that were added before have been called and destroyed. Not for `give` itself.
  void Flush();

 private:
  Answers() = default;
  void GiveUntilStopped();

  Mutex mutex_;
  CondVar changed_;
  std::deque<Give> waiting_ ABSL_GUARDED_BY(mutex_);
  int64_t num_added_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t num_given_ ABSL_GUARDED_BY(mutex_) = 0;
  bool is_stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_ANSWERS_H_
