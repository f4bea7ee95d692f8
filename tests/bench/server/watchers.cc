#include "tests/bench/server/watchers.h"

#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>

#include <algorithm>
#include <optional>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/watch_service.pb.h"
#include "tests/bench/server/floor.grpc.pb.h"

namespace hypermap::bench {

class Watcher : public grpc::ClientBidiReactor<v1::WatchRequest, WatchedResponse> {
 public:
  Watcher(const std::shared_ptr<grpc::Channel>& channel, const std::string& map, int64_t after)
      : stub_(channel), told_(after) {
    request_.mutable_scope()->set_map(map);
    request_.set_start_revision(after);
    request_.set_coalesce(true);
    stub_.PrepareBidiStreamingCall(&context_, "/hypermap.v1.WatchService/Watch", {}, this);
    StartWriteLast(&request_, grpc::WriteOptions());
    StartRead(&response_);
    StartCall();
  }
  ~Watcher() override {
    context_.TryCancel();
    const MutexLock lock(&mutex_);
    while (!done_) changed_.Wait(&mutex_);
  }

  absl::Status WaitUntil(int64_t revision) {
    const MutexLock lock(&mutex_);
    while (!done_ && status_.ok() && told_ < revision) changed_.Wait(&mutex_);
    if (told_ >= revision) return status_;
    return status_.ok() ? absl::UnavailableError("a watch ended") : status_;
  }
  std::vector<double> latencies_s() const {
    const MutexLock lock(&mutex_);
    return latencies_s_;
  }
  std::vector<double> received_s() const {
    const MutexLock lock(&mutex_);
    return received_s_;
  }
  int64_t messages() const {
    const MutexLock lock(&mutex_);
    return messages_;
  }
  int64_t bytes() const {
    const MutexLock lock(&mutex_);
    return bytes_;
  }

 private:
  void OnReadDone(bool ok) override {
    if (!ok) return;
    {
      const MutexLock lock(&mutex_);
      ++messages_;
      bytes_ += static_cast<int64_t>(response_.ByteSizeLong());
      Take(response_);
      for (const WatchedResponse& message : response_.coalesced()) Take(message);
      changed_.NotifyAll();
    }
    StartRead(&response_);
  }
  void Take(const WatchedResponse& message) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (message.changes_size() == 0) return;
    if (message.revision() != told_ + 1) {
      status_.Update(absl::InternalError(
          absl::StrCat("Watch: revision ", message.revision(), " after ", told_)));
    }
    const double now = static_cast<double>(absl::GetCurrentTimeNanos()) * 1e-9;
    const double committed =
        static_cast<double>(message.time().seconds()) + message.time().nanos() * 1e-9;
    latencies_s_.push_back(now - committed);
    if (message.more()) return;
    told_ = message.revision();
    received_s_.push_back(now);
  }
  void OnDone(const grpc::Status& status) override {
    const MutexLock lock(&mutex_);
    if (!status.ok() && status.error_code() != grpc::StatusCode::CANCELLED) {
      status_.Update(absl::Status(static_cast<absl::StatusCode>(status.error_code()),
                                  absl::StrCat("Watch: ", status.error_message())));
    }
    done_ = true;
    changed_.NotifyAll();
  }

  grpc::TemplatedGenericStub<v1::WatchRequest, WatchedResponse> stub_;
  grpc::ClientContext context_;
  v1::WatchRequest request_;
  WatchedResponse response_;
  mutable Mutex mutex_;
  CondVar changed_;  // notified when told_, done_ or status_ changes
  int64_t told_ ABSL_GUARDED_BY(mutex_);
  int64_t messages_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  bool done_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
  std::vector<double> latencies_s_ ABSL_GUARDED_BY(mutex_);
  std::vector<double> received_s_ ABSL_GUARDED_BY(mutex_);  // by revision
};

Watchers::Watchers(const Channels& channels, const std::string& map, int64_t after_revision,
                   int count) {
  for (int i = 0; i < count; ++i) {
    watchers_.push_back(
        std::make_unique<Watcher>(channels[i % channels.size()], map, after_revision));
  }
}

Watchers::~Watchers() = default;

absl::Status Watchers::WaitUntil(int64_t revision) {
  for (const auto& watcher : watchers_) {
    HYPERMAP_RETURN_IF_ERROR(watcher->WaitUntil(revision));
  }
  return absl::OkStatus();
}

std::vector<double> Watchers::LatenciesS() const {
  std::vector<double> all;
  for (const auto& watcher : watchers_) {
    const std::vector<double> some = watcher->latencies_s();
    all.insert(all.end(), some.begin(), some.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<double> Watchers::ReceivedS() const { return watchers_.front()->received_s(); }

int64_t Watchers::messages() const {
  int64_t sum = 0;
  for (const auto& watcher : watchers_) sum += watcher->messages();
  return sum;
}

int64_t Watchers::bytes() const {
  int64_t sum = 0;
  for (const auto& watcher : watchers_) sum += watcher->bytes();
  return sum;
}

}  // namespace hypermap::bench
