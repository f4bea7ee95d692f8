#include "ingest/worker/interruption.h"

#include <csignal>
#include <thread>

namespace hypermap::ingest {

void Interruption::Request() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    requested_ = true;
  }
  changed_.notify_all();
}

bool Interruption::requested() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return requested_;
}

bool Interruption::WaitUntil(absl::Time time) const {
  std::unique_lock<std::mutex> lock(mutex_);
  return changed_.wait_until(lock, absl::ToChronoTime(time), [this] { return requested_; });
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
