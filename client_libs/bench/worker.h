// A client of the load with a thread of its own.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_WORKER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_WORKER_H_

#include "absl/status/status.h"
#include "client_libs/bench/recorder.h"
#include "client_libs/bench/schedule.h"

namespace hypermap::bench {

// Open and Run are called on the worker's thread, Stop on any. The results of a worker are read
// when its thread has ended, unless they say otherwise.
class Worker {
 public:
  explicit Worker(OperationKind kind) : recorder_(kind) {}
  virtual ~Worker() = default;
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  // Connects, once. Called again after an error.
  virtual absl::Status Open() = 0;
  // Carries out the operations that are due before the end, and returns when all are answered or
  // given up. Workers that follow the map return after Stop.
  virtual void Run(const RunTimes& times) = 0;
  virtual void Stop() {}

  // Thread safe.
  Recorder& recorder() { return recorder_; }
  const Recorder& recorder() const { return recorder_; }

 private:
  Recorder recorder_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_WORKER_H_
