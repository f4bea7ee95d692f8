// The threads of a load.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_CREW_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_CREW_H_

#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "client_libs/bench/schedule.h"
#include "client_libs/bench/worker.h"

namespace hypermap::bench {

// Runs each worker on a thread of its own: all connect, then all begin at the same time.
//
//    crew.Add(std::make_unique<...>(...));
//    RETURN_IF_ERROR(crew.Connect(absl::Minutes(1)));
//    crew.Begin(times);
//    crew.Finish();
//
// Used by one thread.
class Crew {
 public:
  Crew() = default;
  // Stops all workers and waits for their end.
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  // Returns the worker, which lives as long as the crew.
  template <typename W>
  W* Add(std::unique_ptr<W> worker) {
    W* added = worker.get();
    workers_.push_back(std::move(worker));
    return added;
  }
  const std::vector<std::unique_ptr<Worker>>& workers() const { return workers_; }

  // Starts the threads, and waits until all workers have connected, with retries. Returns the error
  // of one that could not within `limit`.
  absl::Status Connect(absl::Duration limit);
  // Lets the workers run. REQUIRES: Connect returned OK.
  void Begin(const RunTimes& times);
  // Tells all workers to end.
  void Stop();
  // Waits until all workers have ended.
  void Finish();

 private:
  void RunWorker(Worker& worker);
  // Connects a worker with retries. Returns false if it is not wanted any more.
  bool Open(Worker& worker);

  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<std::thread> threads_;

  Mutex mutex_;
  CondVar changed_;
  size_t num_connected_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status problem_ ABSL_GUARDED_BY(mutex_);  // of the last attempt that failed
  std::optional<RunTimes> times_ ABSL_GUARDED_BY(mutex_);
  bool dismissed_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_CREW_H_
