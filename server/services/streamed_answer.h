// Answers of many messages.
#ifndef HYPERMAP_SERVER_SERVICES_STREAMED_ANSWER_H_
#define HYPERMAP_SERVER_SERVICES_STREAMED_ANSWER_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <memory>
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
  // Answers in the messages so far, for the log.
  virtual int64_t items() const = 0;
};

// Streams what a source makes: one message is held at a time, and the next is made only when gRPC
// has taken it, so that a slow reader costs no memory. Looks before every step whether the answer
// is still wanted, and lets others have the worker after kTurn. Owns itself: gRPC calls OnDone when
// Finish has been called and no operation is left, and Finish is only called between operations.
template <typename Response>
class StreamedAnswer final : public grpc::ServerWriteReactor<Response> {
 public:
  using Source = MessageSource<Response>;
  using OpenSource = absl::AnyInvocable<absl::StatusOr<std::unique_ptr<Source>>() &&>;

  using Done = absl::AnyInvocable<void() &&>;
  using StartWait = absl::FunctionRef<void(RevisionWait&, Done)>;

  // `open` is called on a worker. The context lives until OnDone.
  StreamedAnswer(const grpc::CallbackServerContext* context, RequestLog log, WorkerPool* workers,
                 OpenSource open)
      : StreamedAnswer(context, std::move(log), workers, std::move(open),
                       [](RevisionWait& /*wait*/, Done done) { std::move(done)(); }) {}
  // Begins when the wait that `start_wait` starts is done.
  StreamedAnswer(const grpc::CallbackServerContext* context, RequestLog log, WorkerPool* workers,
                 OpenSource open, StartWait start_wait)
      : context_(context), log_(std::move(log)), workers_(workers), open_(std::move(open)) {
    start_wait(wait_, [this] { workers_->Run([this] { TakeTurn(); }); });
  }

  void OnCancel() override { wait_.Stop(); }

  void OnWriteDone(bool ok) override {
    if (!ok) return End(absl::CancelledError("the caller went away"));
    workers_->Run([this] { TakeTurn(); });
  }
  void OnDone() override { delete this; }

 private:
  static constexpr absl::Duration kTurn = absl::Milliseconds(10);

  void TakeTurn() {
    const absl::Time end_of_turn = absl::Now() + kTurn;
    do {
      const absl::StatusOr<typename Source::Step> step = TakeStep();
      if (!step.ok()) return End(step.status());
      if (*step == Source::Step::kEnd) return End(absl::OkStatus());
      if (*step == Source::Step::kMessage) return this->StartWrite(&message_);
    } while (absl::Now() < end_of_turn);
    workers_->Run([this] { TakeTurn(); });
  }

  absl::StatusOr<typename Source::Step> TakeStep() {
    if (absl::Status status = CheckWanted(*context_); !status.ok()) return status;
    if (!source_) {
      absl::StatusOr<std::unique_ptr<Source>> source = std::move(open_)();
      if (!source.ok()) return source.status();
      source_ = *std::move(source);
    }
    message_.Clear();
    return source_->Next(&message_);
  }

  void End(const absl::Status& status) {
    log_.Finished(status, source_ ? source_->items() : 0);
    this->Finish(wire::EncodeStatus(status));
  }

  const grpc::CallbackServerContext* const context_;
  const RequestLog log_;
  WorkerPool* const workers_;
  OpenSource open_;
  RevisionWait wait_;
  std::unique_ptr<Source> source_;
  Response message_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_STREAMED_ANSWER_H_
