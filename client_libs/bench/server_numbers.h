// CPU time and memory of the server, read from its metrics while a load runs.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_SERVER_NUMBERS_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_SERVER_NUMBERS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"

namespace hypermap::bench {

// The server's use of resources at one time.
struct ServerSample {
  double started_s = 0.0;  // start of the process, since 1970
  double cpu_s = 0.0;      // since the start of the process
  int64_t resident_bytes = 0;
  int64_t threads = 0;
  int64_t open_files = 0;
};

// Reads a sample from a text in Prometheus' format. NOT_FOUND naming the metric that is missing.
absl::StatusOr<ServerSample> ParseServerSample(absl::string_view text);

// Gets /metrics of HOST:PORT by plain HTTP. `address` may begin with http:// and have a path, which
// is not used. INVALID_ARGUMENT, or UNAVAILABLE if there is no answer within `timeout`.
absl::StatusOr<std::string> GetMetrics(const std::string& address, absl::Duration timeout);

// GetMetrics and ParseServerSample.
absl::StatusOr<ServerSample> GetServerSample(const std::string& address, absl::Duration timeout);

// The samples of a load.
struct ServerNumbers {
  int64_t num_samples = 0;
  int64_t num_failures = 0;  // times at which the server gave no answer
  int num_restarts = 0;      // samples of another process than the one before
  // CPU time between the first and the last sample, without that of a process before its last
  // sample, and the time between these samples.
  double cpu_s = 0.0;
  double elapsed_s = 0.0;
  ServerSample first;
  ServerSample last;
  int64_t max_resident_bytes = 0;
  int64_t max_threads = 0;
  int64_t max_open_files = 0;
  SteadyTime first_at = SteadyTime::InfinitePast();

  void Add(const ServerSample& sample, SteadyTime at);
};

// Samples on a thread of its own from Start on. Thread safe.
class ServerSampler {
 public:
  ServerSampler(std::string address, absl::Duration interval);
  ~ServerSampler();
  ServerSampler(const ServerSampler&) = delete;
  ServerSampler& operator=(const ServerSampler&) = delete;

  // RESOURCE_EXHAUSTED if there is no thread.
  absl::Status Start();
  // Takes a last sample and ends.
  void Stop();
  ServerNumbers numbers() const;

 private:
  void Run();
  void Sample();

  const std::string address_;
  const absl::Duration interval_;
  mutable Mutex mutex_;
  CondVar stop_;
  bool stopped_ ABSL_GUARDED_BY(mutex_) = false;
  ServerNumbers numbers_ ABSL_GUARDED_BY(mutex_);
  std::thread thread_;
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_SERVER_NUMBERS_H_
