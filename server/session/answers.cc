#include "server/session/answers.h"

#include <utility>

#include "base/status/status_macros.h"
#include "base/sync/start_thread.h"

namespace hypermap::server {

absl::StatusOr<std::unique_ptr<Answers>> Answers::Start() {
  std::unique_ptr<Answers> answers(new Answers());
  HYPERMAP_ASSIGN_OR_RETURN(answers->thread_, StartThread("hm-answers", [answers = answers.get()] {
                              answers->GiveUntilStopped();
                            }));
  return answers;
}

Answers::~Answers() {
  {
    const MutexLock lock(&mutex_);
    is_stopping_ = true;
    changed_.NotifyAll();
  }
  if (thread_.joinable()) thread_.join();
}

void Answers::Add(Give give) {
  const MutexLock lock(&mutex_);
  waiting_.push_back(std::move(give));
  ++num_added_;
  changed_.NotifyAll();
}

void Answers::Flush() {
  const MutexLock lock(&mutex_);
  const int64_t last = num_added_;
  while (num_given_ < last) changed_.Wait(&mutex_);
}

void Answers::GiveUntilStopped() {
  while (true) {
    {
      Give give;
      {
        const MutexLock lock(&mutex_);
        while (waiting_.empty() && !is_stopping_) changed_.Wait(&mutex_);
        if (waiting_.empty()) return;
        give = std::move(waiting_.front());
        waiting_.pop_front();
      }
      std::move(give)();
    }
    const MutexLock lock(&mutex_);
    ++num_given_;
    changed_.NotifyAll();
  }
}

}  // namespace hypermap::server
