#include "base/sync/executor.h"

#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "base/sync/mutex.h"
#include "base/sync/start_thread.h"

namespace hypermap {
namespace {

class LoopThread : public Executor::Running {
 public:
  explicit LoopThread(Executor::Step step) : step_(std::move(step)) {}
  ~LoopThread() override { LoopThread::Join(); }

  absl::Status Start(ThreadName name) {
    absl::StatusOr<std::thread> thread = StartThread(name, [this] { Run(); });
    if (!thread.ok()) return thread.status();
    thread_ = *std::move(thread);
    return absl::OkStatus();
  }

  void Wake() override {
    const MutexLock lock(&mutex_);
    is_due_ = true;
    changed_.NotifyOne();
  }

  void Join() override {
    if (thread_.joinable()) thread_.join();
  }

 private:
  void Run() {
    while (const std::optional<absl::Duration> sleep = step_()) Sleep(*sleep);
  }

  // Without a loop: a step after a spurious wake-up finds nothing to do.
  void Sleep(absl::Duration longest) {
    const MutexLock lock(&mutex_);
    if (!is_due_ && longest > absl::ZeroDuration()) changed_.WaitFor(&mutex_, longest);
    is_due_ = false;
  }

  Executor::Step step_;
  Mutex mutex_;
  CondVar changed_;
  bool is_due_ ABSL_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

class OneThreadEach : public Executor {
 public:
  SteadyTime Now() const override { return SteadyTime::Now(); }

  absl::StatusOr<std::unique_ptr<Running>> Start(ThreadName name, Step step) override {
    auto loop = std::make_unique<LoopThread>(std::move(step));
    if (absl::Status status = loop->Start(name); !status.ok()) return status;
    return loop;
  }
};

}  // namespace

Executor& ThreadExecutor() {
  static auto* const executor = new OneThreadEach;
  return *executor;
}

}  // namespace hypermap
