// Times at which the server was away, as its clients saw it.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_OUTAGES_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_OUTAGES_H_

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::bench {

// An outage begins with the first failure of any client. It ends when all clients are back: each
// has had an answer after its own last failure. Clients that notice nothing are back with their
// next answer after the first one of a client that had failed.
struct Outage {
  SteadyTime last_answer_before = SteadyTime::InfinitePast();
  SteadyTime first_failure = SteadyTime::InfinitePast();
  std::optional<SteadyTime> first_answer_after;
  std::optional<SteadyTime> all_back;
  int num_failed = 0;   // clients that noticed it
  int num_waiting = 0;  // clients that are not back

  // From the last answer to any client before the first failure until the first answer to a client
  // that had failed. Other clients may have had answers meanwhile.
  std::optional<absl::Duration> Down() const;
  // From the first answer after until all clients are back.
  std::optional<absl::Duration> AllBack() const;
};

// Notes the answers and failures of clients. Thread safe; an answer costs an atomic operation or
// two while there is no outage.
class OutageLog {
 public:
  // Returns the number of a new client. All clients are added before the first failure.
  int AddClient();
  void Answered(int client, SteadyTime at);
  void Failed(int client, SteadyTime at);

  // All outages so far, in order; the last one may not be over.
  std::vector<Outage> outages() const;

 private:
  void AnsweredInOutage(int client, SteadyTime at) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  enum class Standing : uint8_t { kNotNoticed, kFailed, kBack };

  const SteadyTime begin_ = SteadyTime::Now();
  std::atomic<int64_t> last_answer_ns_ = -1;  // after begin_; -1: none
  std::atomic<bool> is_open_ = false;         // there is an outage
  mutable Mutex mutex_;
  std::vector<Standing> standings_ ABSL_GUARDED_BY(mutex_);  // in the current outage
  std::vector<Outage> outages_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_OUTAGES_H_
