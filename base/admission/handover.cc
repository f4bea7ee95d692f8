#include "base/admission/handover.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "absl/status/status.h"
#include "base/sync/deadline.h"
#include "base/sync/start_thread.h"

namespace hypermap::admission {

absl::StatusOr<std::unique_ptr<Handover>> Handover::Start(
    std::function<void(FileDescriptor socket)> accept) {
  std::unique_ptr<Handover> handover(new Handover(std::move(accept)));
  const MutexLock lock(&handover->mutex_);
  if (!handover->StartOne()) return absl::ResourceExhaustedError("no thread can be started");
  return handover;
}

Handover::Handover(std::function<void(FileDescriptor socket)> accept)
    : accept_(std::move(accept)),
      niceness_(getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()))) {}

Handover::~Handover() {
  std::vector<std::thread> threads;
  {
    const MutexLock lock(&mutex_);
    stopping_ = true;
    waiting_.clear();
    const Deadline end(kGrace);
    while (!given_.empty() && !end.has_passed()) was_given_.WaitFor(&mutex_, end.left());
    for (const int socket : given_) shutdown(socket, SHUT_RDWR);
    std::swap(threads, threads_);
  }
  changed_.NotifyAll();
  for (std::thread& thread : threads) thread.join();
}

bool Handover::StartOne() {
  auto thread = StartThread("hm-handover", [this] { Run(); });
  if (!thread.ok()) return false;
  threads_.push_back(*std::move(thread));
  return true;
}

void Handover::Give(FileDescriptor socket) {
  {
    const MutexLock lock(&mutex_);
    waiting_.push_back(std::move(socket));
  }
  changed_.NotifyOne();
}

void Handover::Attend() {
  const MutexLock lock(&mutex_);
  const bool waits = !waiting_.empty();
  // Without another thread, those that there are give the connections later.
  if (waits && waited_ && !stopping_ && static_cast<int>(threads_.size()) < kMaxThreads) {
    StartOne();
  }
  waited_ = waits;
}

void Handover::Run() {
  // A thread inherits the priority of the one that started it.
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness_);
  while (true) {
    FileDescriptor socket;
    FileDescriptor duplicate;
    {
      const MutexLock lock(&mutex_);
      while (!stopping_ && waiting_.empty()) changed_.Wait(&mutex_);
      if (stopping_) return;
      socket = std::move(waiting_.front());
      waiting_.pop_front();
      waited_ = false;
      duplicate = FileDescriptor(fcntl(socket.get(), F_DUPFD_CLOEXEC, 0));
      if (duplicate.is_open()) given_.insert(duplicate.get());
    }
    accept_(std::move(socket));
    const MutexLock lock(&mutex_);
    given_.erase(duplicate.get());
    was_given_.NotifyOne();
  }
}

}  // namespace hypermap::admission
