// A call of the rpc Watch or Replicate, which is opened again after a break. Only for the sources
// of this folder.
#ifndef HYPERMAP_CLIENT_LIBS_CPP_WATCH_STREAM_H_
#define HYPERMAP_CLIENT_LIBS_CPP_WATCH_STREAM_H_

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "base/sync/deadline.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/cpp/backoff.h"
#include "client_libs/cpp/channel.h"
#include "client_libs/cpp/connection.h"
#include "client_libs/cpp/decode.h"
#include "client_libs/cpp/watch.h"
#include "client_libs/cpp/watch_decoder.h"
#include "hypermap/v1/watch_service.grpc.pb.h"
#include "wire/status.h"

namespace hypermap::client {

// Interface between Watcher and the rpc behind it. Next runs on the caller's thread, Cancel on any.
class Watcher::Call {
 public:
  virtual ~Call() = default;
  virtual std::optional<WatchEvent> Next() = 0;
  virtual const absl::Status& status() const = 0;
  virtual std::optional<Revision> revision() const = 0;
  virtual uint64_t incarnation() const = 0;
  virtual int num_resumed() const = 0;
  virtual void Cancel() = 0;
};

// The rpc Watch or Replicate, which is opened again after a break. Both have the same fields for
// what happens here.
template <typename Request, typename Response>
class WatchStream final : public Watcher::Call {
 public:
  using Method = std::unique_ptr<grpc::ClientReader<Response>> (v1::WatchService::Stub::*)(
      grpc::ClientContext*, const Request&);

  // See WatchOptions.
  struct Options {
    bool resume = true;
    absl::Duration retry_for;
    absl::Duration idle_timeout;
    bool snapshot_when_compacted = false;
    bool with_changes = true;
  };

  WatchStream(std::shared_ptr<Connection> connection, Method method, Request request,
              const Options& options, const Deadline& deadline)
      : connection_(std::move(connection)),
        method_(method),
        options_(options),
        decoder_(options.with_changes),
        deadline_(deadline),
        request_(std::move(request)) {
    Open();
    if (options_.idle_timeout != absl::InfiniteDuration()) {
      watchdog_ = std::thread([this] { BreakSilence(); });
    }
  }

  ~WatchStream() override {
    Cancel();
    if (watchdog_.joinable()) watchdog_.join();
    Drain();
  }

  std::optional<WatchEvent> Next() override {
    while (!finished_) {
      Response message;
      if (!Read(message)) {
        Recover(wire::DecodeStatus(Close()));
        continue;
      }
      if (begun_ && broken_since_ != SteadyTime::InfiniteFuture()) ++num_resumed_;
      begun_ = true;
      broken_since_ = SteadyTime::InfiniteFuture();
      backoff_.Reset();
      absl::StatusOr<std::optional<WatchEvent>> event = decoder_.Take(message);
      if (!event.ok()) {
        Cancel();
        Drain();
        Finish(BadAnswer(event.status()));
      } else if (*event) {
        return Deliver(**std::move(event));
      }
    }
    return std::nullopt;
  }

  const absl::Status& status() const override { return status_; }
  std::optional<Revision> revision() const override { return decoder_.revision(); }
  uint64_t incarnation() const override { return decoder_.incarnation(); }
  int num_resumed() const override { return num_resumed_; }

  void Cancel() override {
    const MutexLock lock(&mutex_);
    cancelled_ = true;
    cancel_.NotifyAll();
    if (context_) context_->TryCancel();
  }

 private:
  void Open() {
    server_ = &connection_->servers().current();
    const MutexLock lock(&mutex_);
    context_ = Connection::NewContext(deadline_);
    if (cancelled_) context_->TryCancel();
    reader_ = (server_->stub<v1::WatchService::Stub>().*method_)(context_.get(), request_);
  }

  // Reads the next message into `message`, which must be empty, taking coalesced messages apart.
  bool Read(Response& message) {
    while (next_coalesced_ == coalesced_.coalesced_size()) {
      Response read;
      ListenUntil(SteadyTime::Now() + options_.idle_timeout);
      const bool is_read = reader_->Read(&read);
      ListenUntil(SteadyTime::InfiniteFuture());
      if (!is_read) return false;
      // To move a message is to swap it. `read` ends with what it gets, and so must not outlive
      // this round: the new messages would keep all earlier ones.
      const bool is_coalesced = read.coalesced_size() > 0;
      (is_coalesced ? coalesced_ : message) = std::move(read);
      if (!is_coalesced) return true;
      next_coalesced_ = 0;
    }
    message = std::move(*coalesced_.mutable_coalesced(next_coalesced_++));
    return true;
  }

  void ListenUntil(SteadyTime time) {
    const MutexLock lock(&mutex_);
    listen_until_ = time;
  }

  // Runs on the watchdog's thread. Cancels a call on which nothing arrives for idle_timeout, since
  // a dead connection may give no other sign.
  void BreakSilence() {
    const MutexLock lock(&mutex_);
    while (!cancelled_) {
      cancel_.WaitFor(&mutex_, options_.idle_timeout / 4);
      if (cancelled_ || SteadyTime::Now() < listen_until_ || !context_) continue;
      context_->TryCancel();
      listen_until_ = SteadyTime::InfiniteFuture();
    }
  }

  // Ends the call. Messages that have arrived are dropped.
  void Drain() {
    if (!reader_) return;
    Response ignored;
    while (reader_->Read(&ignored)) {
    }
    Close();
  }

  // Returns the status of a call whose last message has been read.
  grpc::Status Close() {
    grpc::Status status = reader_->Finish();
    const MutexLock lock(&mutex_);
    status = NamedStatus(status, *context_);
    reader_.reset();
    context_.reset();
    return status;
  }

  void Finish(absl::Status status) {
    finished_ = true;
    status_ = std::move(status);
  }

  WatchEvent Deliver(WatchEvent event) {
    connection_->seen().Note(request_.scope().map(), {event.incarnation, event.revision});
    request_.set_start_revision(event.revision);
    request_.mutable_scope()->set_incarnation(event.incarnation);
    if (event.snapshot) event.reset |= std::exchange(starts_anew_, false);
    return event;
  }

  // Opens the next call, after a break with a pause, or finishes the watch.
  void Recover(absl::Status why) {
    decoder_.DropPart();
    if (NeedsSnapshot(why) && options_.snapshot_when_compacted && request_.has_start_revision()) {
      request_.clear_start_revision();
      request_.mutable_scope()->clear_incarnation();
      starts_anew_ = true;
      // The server has answered, and can be asked at once.
      broken_since_ = std::min(broken_since_, SteadyTime::Now());
      if (cancelled()) return Finish(absl::CancelledError("the watch was cancelled"));
      return Open();
    }
    // Too slow a reader is no fault of the server. All else that lets a watch go on elsewhere is.
    const bool may_go_on = MayGoOn(why);
    if (absl::IsUnavailable(why) || (may_go_on && !absl::IsResourceExhausted(why))) {
      connection_->servers().Leave(*server_);
    }
    if (!may_go_on) return Finish(std::move(why));
    broken_since_ = std::min(broken_since_, SteadyTime::Now());
    const absl::Duration pause = backoff_.Next();
    if (SteadyTime::Now() + pause >= RetryUntil() || pause >= deadline_.left()) {
      return Finish(std::move(why));
    }
    Pause(connection_->servers().current().channel(), pause, [this] { return cancelled(); });
    if (cancelled()) return Finish(absl::CancelledError("the watch was cancelled"));
    Open();
  }

  // The time before which the next call may be opened. Before the first message, each server is
  // tried at least once.
  SteadyTime RetryUntil() {
    if (begun_) return broken_since_ + options_.retry_for;
    if (num_untried_ == 0) return broken_since_ + connection_->options().retry_for;
    --num_untried_;
    return SteadyTime::InfiniteFuture();
  }

  // Returns whether the server can't continue from the revision that was asked for: its changes are
  // no longer kept, or the map is another incarnation.
  bool NeedsSnapshot(const absl::Status& why) const {
    if (absl::IsAborted(why)) return request_.scope().incarnation() != 0;
    return absl::IsOutOfRange(why);
  }

  bool MayGoOn(const absl::Status& why) const {
    if (cancelled()) return false;
    if (!begun_) return absl::IsUnavailable(why);
    if (!options_.resume) return false;
    // A server that stops ends or cancels its watches. A server that finds this reader too slow
    // ends the watch with RESOURCE_EXHAUSTED.
    return why.ok() || absl::IsUnavailable(why) || absl::IsCancelled(why) ||
           absl::IsResourceExhausted(why);
  }

  bool cancelled() const {
    const MutexLock lock(&mutex_);
    return cancelled_;
  }

  const std::shared_ptr<Connection> connection_;
  const Method method_;
  const Options options_;
  WatchDecoder<Response> decoder_;
  const Deadline deadline_;
  Request request_;           // for the next call
  Server* server_ = nullptr;  // of the call
  std::unique_ptr<grpc::ClientReader<Response>> reader_;
  Response coalesced_;  // the last message with several, and the index of the next of them
  int next_coalesced_ = 0;
  Backoff backoff_;
  SteadyTime broken_since_ = SteadyTime::InfiniteFuture();
  size_t num_untried_ = connection_->servers().size() - 1;
  bool begun_ = false;
  bool starts_anew_ = false;  // the next snapshot replaces everything reported before
  int num_resumed_ = 0;
  bool finished_ = false;
  absl::Status status_;
  mutable Mutex mutex_;
  CondVar cancel_;  // notified when cancelled_ is set
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  std::unique_ptr<grpc::ClientContext> context_ ABSL_GUARDED_BY(mutex_);
  // Time at which the watchdog cancels the call; infinite while the reader does not read.
  SteadyTime listen_until_ ABSL_GUARDED_BY(mutex_) = SteadyTime::InfiniteFuture();
  std::thread watchdog_;
};

}  // namespace hypermap::client

#endif  // HYPERMAP_CLIENT_LIBS_CPP_WATCH_STREAM_H_
