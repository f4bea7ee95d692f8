#include "ingest/worker/interruption.h"

#include <algorithm>
#include <csignal>
#include <thread>

#include "absl/time/time.h"

namespace hypermap::ingest {
namespace {

// Longest single wait. An infinite timeout would overflow the clock of CondVar and end at once.
constexpr absl::Duration kMaxWait = absl::Minutes(1);

}  // namespace

void Interruption::Request() {
  {
    const MutexLock lock(&mutex_);
    requested_ = true;
  }
  changed_.NotifyAll();
}

bool Interruption::requested() const {
  const MutexLock lock(&mutex_);
  return requested_;
}

bool Interruption::WaitUntil(SteadyTime time) const {
  const MutexLock lock(&mutex_);
  while (!requested_) {
    const absl::Duration left = time - SteadyTime::Now();
    if (left <= absl::ZeroDuration()) break;
    changed_.WaitFor(&mutex_, std::min(left, kMaxWait));
  }
  return requested_;
}

SignalWatch::SignalWatch(Interruption& interruption) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // The thread lives as long as the program. It unblocks the signals for itself after the first, so
  // that the second has its default action.
  std::thread([&interruption, signals] {
    int signal = 0;
    sigwait(&signals, &signal);
    interruption.Request();
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }).detach();
}

}  // namespace hypermap::ingest
