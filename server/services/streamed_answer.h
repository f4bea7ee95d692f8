// Answers of many messages.
#ifndef HYPERMAP_SERVER_SERVICES_STREAMED_ANSWER_H_
#define HYPERMAP_SERVER_SERVICES_STREAMED_ANSWER_H_

#include <google/protobuf/arena.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "server/services/request_log.h"
#include "server/services/revision_wait.h"
#include "server/services/wanted.h"
#include "server/services/worker_pool.h"
#include "wire/status.h"

namespace hypermap::server {

// Makes an answer's messages one by one. One thread at a time.
template <typename Response>
class MessageSource {
 public:
  enum class Step { kMessage, kNothingYet, kEnd };

  virtual ~MessageSource() = default;
  // Fills the empty message, or does a bounded amount of work towards it.
  virtual absl::StatusOr<Step> Next(Response* message) = 0;
  // Whether it is known that the last message was made; kEnd comes in any case.
  virtual bool done() const { return false; }
  // Answers in the messages so far, for the log.
  virtual int64_t items() const = 0;
};

// Streams what a source makes: one message is held at a time, and the next is made only when gRPC
// has taken it, so that a slow reader costs no memory. Looks before every step whether the answer
// is still wanted, and lets others have the worker after kTurn. An answer that is likely to be
// short is begun on gRPC's thread; if it is not, the workers get it after kShortTurn. Owns itself:
// gRPC calls OnDone when Finish has been called and no operation is left, and Finish is only called
// between operations.
template <typename Response>
class StreamedAnswer final : public grpc::ServerWriteReactor<Response> {
 public:
  using Source = MessageSource<Response>;
  using OpenSource = absl::AnyInvocable<absl::StatusOr<std::unique_ptr<Source>>() &&>;

  using Done = absl::AnyInvocable<void() &&>;
  using StartWait = absl::FunctionRef<void(RevisionWait&, Done)>;

  // kAtOnce: on gRPC's thread, for what is likely to be short.
  enum class Begin { kOnWorker, kAtOnce };

  // `open` is called where it begins. The context lives until OnDone.
  StreamedAnswer(const grpc::CallbackServerContext* context, RequestLog log, WorkerPool* workers,
                 OpenSource open, Begin begin = Begin::kOnWorker)
      : context_(context), log_(std::move(log)), workers_(workers), open_(std::move(open)) {
    if (begin == Begin::kAtOnce) {
      TakeTurn(kShortTurn);
    } else {
      RunOnWorker();
    }
  }
  // Begins when the wait that `start_wait` starts is done.
  StreamedAnswer(const grpc::CallbackServerContext* context, RequestLog log, WorkerPool* workers,
                 OpenSource open, StartWait start_wait)
      : context_(context), log_(std::move(log)), workers_(workers), open_(std::move(open)) {
    wait_.emplace();
    start_wait(*wait_, [this] { RunOnWorker(); });
  }

  void OnCancel() override {
    if (wait_) wait_->Stop();
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return End(absl::CancelledError("the caller went away"));
    RunOnWorker();
  }
  void OnDone() override { delete this; }

 private:
  static constexpr absl::Duration kTurn = absl::Milliseconds(10);
  static constexpr absl::Duration kShortTurn = absl::Milliseconds(1);
  // Holds a short answer.
  static constexpr size_t kArenaBytes = 4096;

  void RunOnWorker() {
    workers_->Run([this] { TakeTurn(kTurn); });
  }

  void TakeTurn(absl::Duration turn) {
    const absl::Time end_of_turn = absl::Now() + turn;
    do {
      const absl::StatusOr<typename Source::Step> step = TakeStep();
      if (!step.ok()) return End(step.status());
      if (*step == Source::Step::kEnd) return End(absl::OkStatus());
      if (*step == Source::Step::kMessage) return Write();
    } while (absl::Now() < end_of_turn);
    RunOnWorker();
  }

  absl::StatusOr<typename Source::Step> TakeStep() {
    if (absl::Status status = CheckWanted(*context_); !status.ok()) return status;
    if (!source_) {
      absl::StatusOr<std::unique_ptr<Source>> source = std::move(open_)();
      if (!source.ok()) return source.status();
      source_ = *std::move(source);
    }
    arena_.Reset();
    message_ = google::protobuf::Arena::CreateMessage<Response>(&arena_);
    return source_->Next(message_);
  }

  void Write() {
    if (!source_->done()) return this->StartWrite(message_);
    // One operation in place of two.
    log_.Finished(absl::OkStatus(), source_->items());
    this->StartWriteAndFinish(message_, grpc::WriteOptions(), grpc::Status::OK);
  }

  void End(const absl::Status& status) {
    log_.Finished(status, source_ ? source_->items() : 0);
    this->Finish(wire::EncodeStatus(status));
  }

  const grpc::CallbackServerContext* const context_;
  const RequestLog log_;
  WorkerPool* const workers_;
  OpenSource open_;
  std::optional<RevisionWait> wait_;  // set where this is made, if at all
  std::unique_ptr<Source> source_;
  alignas(std::max_align_t) char block_[kArenaBytes];
  google::protobuf::Arena arena_{block_, sizeof block_};
  Response* message_ = nullptr;  // on arena_
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_STREAMED_ANSWER_H_
