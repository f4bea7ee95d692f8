#include "tests/bench/server/load.h"

#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"

namespace hypermap::bench {
namespace {

// One unary or streaming call, which its owner repeats. Calls `done` when it has ended.
class Call : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  Call(const std::shared_ptr<grpc::Channel>& channel, std::function<void(const grpc::Status&)> done)
      : stub_(channel), done_(std::move(done)) {}

  void Start(const Calls& calls, int64_t index, bool keep) {
    context_.emplace();
    request_ = calls.request(index);
    kept_.clear();
    keep_ = keep;
    if (!calls.streamed) {
      stub_.UnaryCall(&*context_, calls.method, {}, &request_, &response_,
                      [this](const grpc::Status& status) {
                        if (keep_) kept_ = Joined(response_);
                        done_(status);
                      });
      return;
    }
    // Sends headers, request and half-close together, as a generated stub does.
    context_->set_initial_metadata_corked(true);
    stub_.PrepareBidiStreamingCall(&*context_, calls.method, {}, this);
    StartWriteLast(&request_, grpc::WriteOptions());
    StartRead(&response_);
    StartCall();
  }
  std::string TakeKept() { return std::move(kept_); }

 private:
  void OnReadDone(bool ok) override {
    if (!ok) return;
    if (keep_) kept_ += Joined(response_);
    StartRead(&response_);
  }
  void OnDone(const grpc::Status& status) override { done_(status); }

  grpc::GenericStub stub_;
  const std::function<void(const grpc::Status&)> done_;
  std::optional<grpc::ClientContext> context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  bool keep_ = false;
  std::string kept_;
};

absl::Status AsAbsl(const std::string& method, const grpc::Status& status) {
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()),
                      absl::StrCat(method, ": ", status.error_message()));
}

// All callers of a run. Each makes calls until `more` returns false.
class Crowd {
 public:
  using MoreFn = std::function<bool(int64_t index)>;
  Crowd(const Channels& channels, const Calls& calls, bool keep, MoreFn more)
      : calls_(calls), keep_(keep), more_(std::move(more)), running_(channels.size()) {
    for (const auto& channel : channels) {
      callers_.push_back(std::make_unique<Caller>());
      Caller* const caller = callers_.back().get();
      caller->call = std::make_unique<Call>(
          channel, [this, caller](const grpc::Status& status) { Ended(caller, status); });
    }
  }

  absl::Status Run() {
    for (const auto& caller : callers_) Next(caller.get());
    const MutexLock lock(&mutex_);
    while (running_ != 0) finished_.Wait(&mutex_);
    return status_;
  }

  std::vector<double> SortedLatencies() const {
    std::vector<double> all;
    for (const auto& caller : callers_) {
      all.insert(all.end(), caller->latencies_s.begin(), caller->latencies_s.end());
    }
    std::sort(all.begin(), all.end());
    return all;
  }
  std::vector<std::string> TakeAnswers(size_t count) {
    std::vector<std::string> answers(count);
    for (const auto& caller : callers_) {
      for (auto& [index, answer] : caller->answers) answers[index] = std::move(answer);
    }
    return answers;
  }

 private:
  struct Caller {
    std::unique_ptr<Call> call;
    int64_t index = 0;
    int64_t started_ns = 0;
    std::vector<double> latencies_s;
    std::vector<std::pair<int64_t, std::string>> answers;
  };

  void Next(Caller* caller) {
    caller->index = next_.fetch_add(1);
    if (failed_ || !more_(caller->index)) {
      const MutexLock lock(&mutex_);
      // Notified under the lock, because Run's caller may destroy this once it is released.
      if (--running_ == 0) finished_.NotifyAll();
      return;
    }
    caller->started_ns = absl::GetCurrentTimeNanos();
    caller->call->Start(calls_, caller->index, keep_);
  }

  void Ended(Caller* caller, const grpc::Status& status) {
    caller->latencies_s.push_back(
        static_cast<double>(absl::GetCurrentTimeNanos() - caller->started_ns) * 1e-9);
    if (!status.ok()) {
      failed_ = true;
      const MutexLock lock(&mutex_);
      status_.Update(AsAbsl(calls_.method, status));
    } else if (keep_) {
      caller->answers.emplace_back(caller->index, caller->call->TakeKept());
    }
    Next(caller);
  }

  const Calls& calls_;
  const bool keep_;
  const MoreFn more_;
  std::vector<std::unique_ptr<Caller>> callers_;
  std::atomic<int64_t> next_ = 0;
  std::atomic<bool> failed_ = false;
  Mutex mutex_;
  CondVar finished_;  // notified when running_ becomes 0
  int64_t running_ ABSL_GUARDED_BY(mutex_);
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace

Channels OpenChannels(const std::string& address, int count) {
  Channels channels;
  for (int i = 0; i < count; ++i) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetMaxReceiveMessageSize(-1);
    channels.push_back(
        grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  }
  return channels;
}

grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message) {
  const grpc::Slice slice(message.SerializeAsString());
  return grpc::ByteBuffer(&slice, 1);
}

std::string Joined(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  std::string joined;
  if (!bytes.Dump(&slices).ok()) return joined;
  for (const grpc::Slice& slice : slices) {
    joined.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return joined;
}

std::function<grpc::ByteBuffer(int64_t)> InTurn(std::vector<grpc::ByteBuffer> requests) {
  return [requests = std::move(requests)](int64_t i) {
    return requests[static_cast<size_t>(i) % requests.size()];
  };
}

double LoadResult::Percentile(double share) const {
  if (latencies_s.empty()) return 0;
  const auto last = static_cast<double>(latencies_s.size() - 1);
  return latencies_s[static_cast<size_t>(last * share)];
}

absl::StatusOr<LoadResult> RunLoad(const Channels& channels, const Calls& calls,
                                   absl::Duration duration) {
  const absl::Time start = absl::Now();
  const int64_t end_ns = absl::ToUnixNanos(start + duration);
  Crowd crowd(channels, calls, false,
              [end_ns](int64_t) { return absl::GetCurrentTimeNanos() < end_ns; });
  HYPERMAP_RETURN_IF_ERROR(crowd.Run());
  LoadResult result;
  result.wall = absl::Now() - start;
  result.latencies_s = crowd.SortedLatencies();
  result.calls = static_cast<int64_t>(result.latencies_s.size());
  return result;
}

absl::StatusOr<std::vector<std::string>> Ask(const Channels& channels, const Calls& calls,
                                             int64_t count) {
  Crowd crowd(channels, calls, true, [count](int64_t index) { return index < count; });
  HYPERMAP_RETURN_IF_ERROR(crowd.Run());
  return crowd.TakeAnswers(static_cast<size_t>(count));
}

}  // namespace hypermap::bench
