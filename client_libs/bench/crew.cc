#include "client_libs/bench/crew.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "base/sync/deadline.h"
#include "base/sync/start_thread.h"
#include "client_libs/cpp/backoff.h"

namespace hypermap::bench {

Crew::~Crew() {
  {
    const MutexLock lock(&mutex_);
    dismissed_ = true;
    changed_.NotifyAll();
  }
  Stop();
  Finish();
}

void Crew::Stop() {
  for (const auto& worker : workers_) worker->Stop();
}

absl::Status Crew::Connect(absl::Duration limit) {
  for (const auto& worker : workers_) {
    HYPERMAP_ASSIGN_OR_RETURN(std::thread thread,
                              StartThread("hm-load", [this, w = worker.get()] { RunWorker(*w); }));
    threads_.push_back(std::move(thread));
  }
  const Deadline deadline(limit);
  const MutexLock lock(&mutex_);
  while (num_connected_ < workers_.size() && !deadline.has_passed()) {
    changed_.WaitFor(&mutex_, deadline.left());
  }
  if (num_connected_ == workers_.size()) return absl::OkStatus();
  const absl::Status why =
      problem_.ok() ? absl::DeadlineExceededError("the server does not answer") : problem_;
  return absl::Status(why.code(),
                      absl::StrCat("only ", num_connected_, " of ", workers_.size(),
                                   " streams are open: ", absl::string_view(why.message())));
}

void Crew::Begin(const RunTimes& times) {
  for (const auto& worker : workers_) worker->recorder().Start(times);
  const MutexLock lock(&mutex_);
  times_ = times;
  changed_.NotifyAll();
}

void Crew::Finish() {
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

bool Crew::Open(Worker& worker) {
  client::Backoff backoff;
  while (true) {
    const absl::Status status = worker.Open();
    const Deadline pause(backoff.Next());
    const MutexLock lock(&mutex_);
    if (dismissed_) return false;
    if (status.ok()) return true;
    problem_ = status;
    while (!dismissed_ && !pause.has_passed()) changed_.WaitFor(&mutex_, pause.left());
  }
}

void Crew::RunWorker(Worker& worker) {
  if (!Open(worker)) return;
  RunTimes times;
  {
    const MutexLock lock(&mutex_);
    ++num_connected_;
    changed_.NotifyAll();
    while (!times_ && !dismissed_) changed_.Wait(&mutex_);
    if (!times_) return;
    times = *times_;
  }
  worker.Run(times);
}

}  // namespace hypermap::bench
