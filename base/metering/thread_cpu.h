// The CPU time of a thread.
#ifndef HYPERMAP_BASE_METERING_THREAD_CPU_H_
#define HYPERMAP_BASE_METERING_THREAD_CPU_H_

#include "absl/time/time.h"

namespace hypermap {

// CPU time that the calling thread has used since it began. For meters: nothing else may depend on
// it, so that runs can be repeated.
absl::Duration ThreadCpuTime();

// Adds the CPU time of the calling thread between its construction and its destruction to a sum,
// which must outlive it.
class ScopedCpuTime {
 public:
  explicit ScopedCpuTime(absl::Duration* sum) : sum_(sum), begin_(ThreadCpuTime()) {}
  ~ScopedCpuTime() { *sum_ += ThreadCpuTime() - begin_; }
  ScopedCpuTime(const ScopedCpuTime&) = delete;
  ScopedCpuTime& operator=(const ScopedCpuTime&) = delete;

 private:
  absl::Duration* const sum_;
  const absl::Duration begin_;
};

}  // namespace hypermap

#endif  // HYPERMAP_BASE_METERING_THREAD_CPU_H_
