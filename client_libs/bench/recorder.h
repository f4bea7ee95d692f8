// Counts what became of the operations of one client.
#ifndef HYPERMAP_CLIENT_LIBS_BENCH_RECORDER_H_
#define HYPERMAP_CLIENT_LIBS_BENCH_RECORDER_H_

#include <cstdint>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/bench/histogram.h"
#include "client_libs/bench/schedule.h"

namespace hypermap::bench {

enum class OperationKind {
  kObservation,      // an observation, until it is acknowledged
  kPoints,           // a batch of points, until it is answered
  kEdit,             // a batch of edits, until it is on disk
  kClaim,            // a goal of an exploration, until it is leased or refused
  kWatchDelivery,    // a revision, from its time until a watcher has received it
  kReplicaDelivery,  // a revision, from its time until a replica has received it
  kReplicaLag,       // a revision, from its time until a replica has applied it and answers at it
};

// Returns "observation", "points", "edit", "claim", "watch_delivery", "replica_delivery" or
// "replica_lag".
absl::string_view OperationKindName(OperationKind kind);

struct OperationTotals {
  LatencyHistogram latencies;  // of the answered operations; its count is their number
  int64_t due = 0;             // operations whose time had come
  int64_t late = 0;            // begun more than one period after they were due
  int64_t errors = 0;          // failed attempts, also of operations that were answered later
  int64_t retries = 0;         // attempts after a failed one; streams that were opened again
  std::string last_error;

  int64_t unanswered() const { return due - latencies.count(); }
  void Merge(const OperationTotals& other);
};

// Counts the operations that are due in the measured part of the run; others are ignored. Thread
// safe.
class Recorder {
 public:
  explicit Recorder(OperationKind kind) : kind_(kind) {}

  OperationKind kind() const { return kind_; }
  // Must be called before the others.
  void Start(const RunTimes& times);

  void Due(SteadyTime due);
  void Late(SteadyTime due);
  void Answered(SteadyTime due, SteadyTime answered);
  // These count if `at` is not before the measured part.
  void Failed(SteadyTime at, const absl::Status& why);
  void Retried(SteadyTime at);

  OperationTotals totals() const;

 private:
  const OperationKind kind_;
  mutable Mutex mutex_;
  RunTimes times_ ABSL_GUARDED_BY(mutex_);
  OperationTotals totals_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::bench

#endif  // HYPERMAP_CLIENT_LIBS_BENCH_RECORDER_H_
