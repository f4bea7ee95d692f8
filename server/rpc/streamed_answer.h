// Server streams: one request, and an answer of many messages.
#ifndef HYPERMAP_SERVER_RPC_STREAMED_ANSWER_H_
#define HYPERMAP_SERVER_RPC_STREAMED_ANSWER_H_

#include <google/protobuf/arena.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/slice.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "base/cancellation/cancellation.h"
#include "base/metering/memory_meter.h"
#include "base/status/status_macros.h"
#include "base/status/unless_memory_fails.h"
#include "base/sync/cancel_scope.h"
#include "base/sync/deadline.h"
#include "server/rpc/budgets.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/forwarded_answer.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/request_log.h"
#include "server/rpc/revision_wait.h"
#include "server/rpc/short_turn.h"
#include "server/rpc/wanted.h"
#include "server/rpc/worker_pool.h"

namespace hypermap::server {

// Makes the messages of an answer one by one. Not thread safe; may be handed from thread to thread.
template <typename Response>
class MessageSource {
 public:
  enum class Step { kMessage, kNothingYet, kEnd };

  virtual ~MessageSource() = default;
  // Fills the empty message (kMessage), or does a bounded amount of work towards it (kNothingYet).
  virtual absl::StatusOr<Step> Next(Response* message) = 0;
  // Returns whether the last message is known to be made, so that it can be written together with
  // the end of the stream. A source need not know: Next returns kEnd after it.
  virtual bool done() const { return false; }
  // Number of items in the messages so far, for the log.
  virtual int64_t items() const = 0;
};

// Answers the request of a raw method with the messages of a MessageSource. It holds one message at
// a time, and makes the next when gRPC has taken it, so that a slow reader costs no memory. Before
// each step, and in its loops (base/cancellation), it checks whether the caller still waits. After
// kTurn it leaves the worker to other requests. Deletes itself in OnDone, which gRPC calls after
// Finish, when no operation is under way; Finish is called between operations only.
//
// Parses and serializes the messages itself, instead of gRPC, so that they are on arenas, and so
// that most of an answer is freed by the thread that made it: gRPC calls OnDone on another one.
//
// If only the owner of the map can answer, which is another server, the answer is the owner's.
template <typename Request, typename Response>
class StreamedAnswer final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  using Source = MessageSource<Response>;
  using OpenSource = absl::AnyInvocable<absl::StatusOr<std::unique_ptr<Source>>(
      const Request& request, absl::string_view client)>;

  using Done = absl::AnyInvocable<void() &&>;
  using StartWait = absl::FunctionRef<void(RevisionWait&, RevisionWait::Done)>;

  // `open` is called with the request and CallTicket::client when the answer begins, and again if
  // it has to begin anew. If `bytes` are no Request, the answer is INVALID_ARGUMENT. The bytes and
  // the context live until OnDone. The answer begins in `workers`; `long_workers` continue it when
  // it takes more than one turn, and parse large requests. A call that is not admitted, or whose
  // bytes are not `acceptable`, is not parsed, and ends when it would begin.
  StreamedAnswer(const CallFacilities& facilities, grpc::CallbackServerContext* context, Rpc rpc,
                 const grpc::ByteBuffer& bytes, WorkerPool* workers, WorkerPool* long_workers,
                 OpenSource open, const absl::Status& acceptable = absl::OkStatus())
      : grpc_context_(context),
        bytes_(bytes),
        context_(facilities, context, rpc),
        workers_(workers),
        long_workers_(long_workers),
        open_(std::move(open)) {
    status_ = Admit(acceptable);
    if (status_.ok() && IsSmallRequest(bytes)) Parse();
  }

  // The parsed request; empty while it is not parsed, or if it could not be.
  const Request& request() const { return *request_; }

  // Calls `begin` when the request is parsed: at once if it is small, otherwise on a long worker.
  // `begin` calls one of the functions below.
  void WhenParsed(Done begin) {
    if (is_parsed_ || !status_.ok()) return std::move(begin)();
    // Before gRPC knows the call, because OnCancel asks for it.
    wait_.emplace();
    long_workers_->Run(context_.origin(), [this, begin = std::move(begin)]() mutable {
      status_ = context_.CheckWanted();
      if (status_.ok()) Parse();
      std::move(begin)();
    });
  }

  // Exactly one of the following must be called, once.

  void BeginOnWorker() {
    if (!status_.ok()) return End(status_);
    RunOn(is_parsed_ ? workers_ : long_workers_);
  }
  // Begins on this thread, which may be gRPC's, for an answer that is likely to be short. If it is
  // not there after kShortTurn, a thread of `long_workers` begins anew. The request must be parsed.
  void BeginAtOnce() {
    ShortTurn short_turn([this, end = EndOfThreadTime(kShortTurn)]() mutable {
      absl::Status wanted = context_.CheckWanted();
      return wanted.ok() ? end() : wanted;
    });
    const std::optional<absl::StatusOr<Step>> step = TakeSteps(kShortTurn, &short_turn);
    // Nothing was sent yet.
    if (!short_turn.status().ok() && context_.CheckWanted().ok()) {
      source_.reset();
      meter_.GiveBack();
      return RunOn(long_workers_);
    }
    GoOn(step);
  }
  // Begins on a worker when the wait that `start_wait` starts has ended, and asks for at least the
  // revision that was waited for; on a long worker if the answer is expected to take long. The
  // request must be parsed.
  void BeginAfter(StartWait start_wait, bool is_long) {
    if (!status_.ok()) return End(status_);
    if (!wait_) wait_.emplace();
    start_wait(*wait_, [this, is_long](const absl::StatusOr<Revision>& reached) {
      status_ = reached.status();
      if (reached.ok()) AskForRevision(*reached, request_);
      RunOn(is_long ? long_workers_ : workers_);
    });
  }

  void OnCancel() override {
    const CancelScope in_cancel(this);
    // gRPC also cancels calls whose deadline has passed.
    if (!IsPastDeadline(*grpc_context_)) context_.ticket().Cancelled();
    if (wait_) wait_->Stop();
  }

  void OnWriteDone(bool ok) override {
    if (forwarded_) return forwarded_->OnWriteDone(ok);
    if (!ok) return End(absl::CancelledError("the caller went away"));
    RunOn(long_workers_);
  }
  void OnDone() override { delete this; }

 private:
  using Step = typename Source::Step;

  static constexpr absl::Duration kTurn = absl::Milliseconds(10);
  // Sizes of the arenas' first blocks: enough for a usual request and a short answer.
  static constexpr size_t kRequestBytes = 896;
  static constexpr size_t kMessageBytes = 4096;

  absl::Status Admit(const absl::Status& acceptable) {
    context_.ticket().Received(bytes_);
    HYPERMAP_RETURN_IF_ERROR(context_.admitted());
    HYPERMAP_RETURN_IF_ERROR(acceptable);
    return context_.ticket().ChargeArrival(Request::default_instance(), bytes_);
  }

  // Sets status_.
  void Parse() {
    is_parsed_ = true;
    status_ = UnlessMemoryFails([&]() -> absl::Status {
      HYPERMAP_RETURN_IF_ERROR(context_.ticket().ChargeRest(Request::default_instance(), bytes_));
      HYPERMAP_RETURN_IF_ERROR(ParseRequest(bytes_, request_));
      return context_.EnterMap(MapOf(*request_));
    });
  }

  void RunOn(WorkerPool* workers) {
    workers->Run(context_.origin(), [this] { TakeTurn(); });
  }

  void TakeTurn() {
    Cancellation cancellation([this] { return context_.CheckWanted(); });
    GoOn(TakeSteps(kTurn, &cancellation));
  }

  // Returns the first step that is more than kNothingYet, or nothing if the turn is over.
  std::optional<absl::StatusOr<Step>> TakeSteps(absl::Duration turn, Cancellation* cancellation) {
    const Deadline end_of_turn(turn);
    do {
      absl::StatusOr<Step> step = TakeStep(cancellation);
      if (!step.ok() || *step != Step::kNothingYet) return step;
    } while (!end_of_turn.has_passed());
    return std::nullopt;
  }

  void GoOn(const std::optional<absl::StatusOr<Step>>& step) {
    if (!step) return RunOn(long_workers_);
    if (!step->ok()) return End(step->status());
    if (**step == Step::kEnd) return End(absl::OkStatus());
    Write();
  }

  absl::StatusOr<Step> TakeStep(Cancellation* cancellation) {
    const ScopedCancellation here(cancellation);
    const ScopedMeter metered(&meter_);
    HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
    absl::StatusOr<Step> step = UnlessMemoryFails([&] { return MakeStep(); });
    // Work that was given up has no result.
    HYPERMAP_RETURN_IF_ERROR(cancellation->status());
    return step;
  }

  absl::StatusOr<Step> MakeStep() {
    if (status_.ok() && !is_parsed_) Parse();
    if (!status_.ok()) return status_;
    if (!source_) {
      HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Source> source,
                                open_(*request_, context_.ticket().client()));
      source_ = std::move(source);
    }
    alignas(std::max_align_t) char block[kMessageBytes];
    google::protobuf::Arena arena(block, sizeof block);
    auto* const message = google::protobuf::Arena::CreateMessage<Response>(&arena);
    absl::StatusOr<Step> step = source_->Next(message);
    if (step.ok() && *step == Step::kMessage) {
      const grpc::Slice slice = Serialize(*message);
      grpc::ByteBuffer(&slice, 1).Swap(&message_);
    }
    return step;
  }

  void Write() {
    has_answered_ = true;
    if (!source_->done()) return StartWrite(&message_);
    const grpc::Status end = context_.End(absl::OkStatus(), source_->items());
    source_.reset();
    // One operation instead of two.
    StartWriteAndFinish(&message_, grpc::WriteOptions(), end);
  }

  void End(const absl::Status& status) {
    if (!has_answered_) {
      if (auto forwarding = context_.ForwardInsteadOf(status)) {
        source_.reset();
        forwarded_.emplace(this, &context_, *std::move(forwarding));
        return forwarded_->Start(bytes_);
      }
    }
    Finish(context_.End(status, source_ ? source_->items() : 0));
  }

  const grpc::CallbackServerContext* const grpc_context_;
  const grpc::ByteBuffer& bytes_;
  alignas(std::max_align_t) char block_[kRequestBytes];
  google::protobuf::Arena arena_{block_, sizeof block_};
  Request* const request_ = google::protobuf::Arena::CreateMessage<Request>(&arena_);
  CallContext context_;
  absl::Status status_;  // why there is no request to answer, or OK
  bool is_parsed_ = false;
  WorkerPool* const workers_;
  WorkerPool* const long_workers_;
  OpenSource open_;
  std::optional<RevisionWait> wait_;       // set before gRPC knows the call
  MemoryMeter meter_{&context_.ticket()};  // of what source_ has read of the past
  std::unique_ptr<Source> source_;
  grpc::ByteBuffer message_;  // the message that is being written
  bool has_answered_ = false;
  std::optional<ForwardedAnswer> forwarded_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_STREAMED_ANSWER_H_
