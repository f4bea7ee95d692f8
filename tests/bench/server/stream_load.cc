#include "tests/bench/server/stream_load.h"

#include <grpcpp/client_context.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/client_callback.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"

namespace hypermap::bench {
namespace {

class Stream : public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // Sends message i while `more(i)` returns true.
  Stream(const std::shared_ptr<grpc::Channel>& channel, const StreamCalls& calls,
         std::function<bool(int64_t)> more, bool keep)
      : stub_(channel), calls_(calls), more_(std::move(more)), keep_(keep) {
    stub_.PrepareBidiStreamingCall(&context_, calls.method, {}, this);
    StartRead(&answer_);
    const MutexLock lock(&mutex_);
    if (calls_.opening) {
      writing_ = true;
      message_ = *calls_.opening;
      StartWrite(&message_);
    } else {
      WriteNext();
    }
    StartCall();
  }

  absl::Status Wait() {
    const MutexLock lock(&mutex_);
    while (!done_) finished_.Wait(&mutex_);
    return status_;
  }
  const std::vector<double>& latencies_s() const { return latencies_s_; }
  std::vector<std::string>& kept() { return kept_; }

 private:
  void WriteNext() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    if (writing_ || ended_ || static_cast<int>(sent_ns_.size()) >= calls_.window) return;
    if (!more_(next_)) {
      ended_ = true;
      StartWritesDone();
      return;
    }
    writing_ = true;
    message_ = calls_.messages[static_cast<size_t>(next_++) % calls_.messages.size()];
    sent_ns_.push_back(absl::GetCurrentTimeNanos());
    StartWrite(&message_);
  }
  void OnWriteDone(bool ok) override {
    const MutexLock lock(&mutex_);
    writing_ = false;
    if (ok) WriteNext();
  }
  void OnReadDone(bool ok) override {
    if (!ok) return;
    const MutexLock lock(&mutex_);
    if (!sent_ns_.empty()) {
      latencies_s_.push_back(static_cast<double>(absl::GetCurrentTimeNanos() - sent_ns_.front()) *
                             1e-9);
      sent_ns_.pop_front();
    }
    if (keep_) kept_.push_back(Joined(answer_));
    WriteNext();
    StartRead(&answer_);
  }
  void OnDone(const grpc::Status& status) override {
    const MutexLock lock(&mutex_);
    if (!status.ok()) {
      status_ = absl::Status(static_cast<absl::StatusCode>(status.error_code()),
                             absl::StrCat(calls_.method, ": ", status.error_message()));
    } else if (!sent_ns_.empty()) {
      status_ = absl::InternalError(absl::StrCat(calls_.method, ": not all was answered"));
    }
    done_ = true;
    finished_.NotifyAll();
  }

  grpc::GenericStub stub_;
  const StreamCalls& calls_;
  const std::function<bool(int64_t)> more_;
  const bool keep_;
  grpc::ClientContext context_;
  grpc::ByteBuffer answer_;
  grpc::ByteBuffer message_;
  Mutex mutex_;
  CondVar finished_;  // notified when done_ is set
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool done_ ABSL_GUARDED_BY(mutex_) = false;
  int64_t next_ ABSL_GUARDED_BY(mutex_) = 0;
  std::deque<int64_t> sent_ns_ ABSL_GUARDED_BY(mutex_);
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
  // Written under mutex_. Not annotated, because they are read without it after Wait.
  std::vector<double> latencies_s_;
  std::vector<std::string> kept_;
};

}  // namespace

absl::StatusOr<LoadResult> RunStreams(const Channels& channels, const StreamCalls& calls,
                                      absl::Duration duration) {
  const absl::Time start = absl::Now();
  const int64_t end_ns = absl::ToUnixNanos(start + duration);
  std::vector<std::unique_ptr<Stream>> streams;
  for (const auto& channel : channels) {
    streams.push_back(std::make_unique<Stream>(
        channel, calls, [end_ns](int64_t) { return absl::GetCurrentTimeNanos() < end_ns; }, false));
  }
  LoadResult result;
  absl::Status status;
  for (const auto& stream : streams) status.Update(stream->Wait());
  HYPERMAP_RETURN_IF_ERROR(status);
  result.wall = absl::Now() - start;
  for (const auto& stream : streams) {
    result.latencies_s.insert(result.latencies_s.end(), stream->latencies_s().begin(),
                              stream->latencies_s().end());
  }
  std::sort(result.latencies_s.begin(), result.latencies_s.end());
  result.calls = static_cast<int64_t>(result.latencies_s.size());
  return result;
}

absl::StatusOr<std::vector<std::string>> AskStream(const Channels& channels,
                                                   const StreamCalls& calls, int count) {
  Stream stream(
      channels.front(), calls, [count](int64_t index) { return index < count; }, true);
  HYPERMAP_RETURN_IF_ERROR(stream.Wait());
  return std::move(stream.kept());
}

}  // namespace hypermap::bench
