#include "client_libs/bench/recorder.h"

namespace hypermap::bench {

absl::string_view OperationKindName(OperationKind kind) {
  switch (kind) {
    case OperationKind::kObservation:
      return "observation";
    case OperationKind::kPoints:
      return "points";
    case OperationKind::kEdit:
      return "edit";
    case OperationKind::kClaim:
      return "claim";
    case OperationKind::kWatchDelivery:
      return "watch_delivery";
    case OperationKind::kReplicaDelivery:
      return "replica_delivery";
    case OperationKind::kReplicaLag:
      return "replica_lag";
  }
  return "";
}

void OperationTotals::Merge(const OperationTotals& other) {
  latencies.Merge(other.latencies);
  due += other.due;
  late += other.late;
  errors += other.errors;
  retries += other.retries;
  if (!other.last_error.empty()) last_error = other.last_error;
}

void Recorder::Start(const RunTimes& times) {
  const MutexLock lock(&mutex_);
  times_ = times;
}

void Recorder::Due(SteadyTime due) {
  const MutexLock lock(&mutex_);
  totals_.due += times_.Counts(due);
}

void Recorder::Late(SteadyTime due) {
  const MutexLock lock(&mutex_);
  totals_.late += times_.Counts(due);
}

void Recorder::Answered(SteadyTime due, SteadyTime answered) {
  const MutexLock lock(&mutex_);
  if (times_.Counts(due)) totals_.latencies.Add(answered - due);
}

void Recorder::Failed(SteadyTime at, const absl::Status& why) {
  const MutexLock lock(&mutex_);
  if (at < times_.measure_from) return;
  ++totals_.errors;
  totals_.last_error = why.ToString();
}

void Recorder::Retried(SteadyTime at) {
  const MutexLock lock(&mutex_);
  totals_.retries += at >= times_.measure_from;
}

OperationTotals Recorder::totals() const {
  const MutexLock lock(&mutex_);
  return totals_;
}

}  // namespace hypermap::bench
