// Unary rpcs: one request, one answer.
#ifndef HYPERMAP_SERVER_RPC_UNARY_CALL_H_
#define HYPERMAP_SERVER_RPC_UNARY_CALL_H_

#include <google/protobuf/arena.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/slice.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/functional/any_invocable.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/cancellation/cancellation.h"
#include "base/limits/limits.h"
#include "base/status/status_macros.h"
#include "server/rpc/call_context.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/raw_messages.h"
#include "server/rpc/revision_wait.h"
#include "server/rpc/worker_pool.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// The encoded messages of a unary call of a raw method, which live until gRPC has sent the answer.
struct RawMessages {
  const grpc::ByteBuffer* request;
  grpc::ByteBuffer* response;
};

// One unary call of a raw method that is under way. It lives until gRPC has sent its answer.
class UnaryCall {
 public:
  virtual ~UnaryCall() = default;
  UnaryCall(const UnaryCall&) = delete;
  UnaryCall& operator=(const UnaryCall&) = delete;

  grpc::ServerUnaryReactor* reactor() { return &reactor_; }
  const CallContext& context() const { return context_; }
  // OK, or the error with which the call must end before any work: that of CallContext::admitted,
  // or because the request is too large, is none, or is about a map to which the caller has no
  // access.
  const absl::Status& admitted() const { return admitted_; }
  // Returns whether the request is parsed. A large one is only when a worker has called
  // EnsureParsed.
  bool is_parsed() const { return is_parsed_; }
  // Parses the request, if that was left to a worker. INVALID_ARGUMENT if the bytes are none, and
  // the errors of CallTicket::ChargeRest and CallContext::EnterMap. Must not be called again after
  // an error, nor if the call is not admitted.
  absl::Status EnsureParsed();
  absl::Status CheckWanted() const { return context_.CheckWanted(); }
  // Must not be used after Finish.
  std::shared_ptr<Cancellation> MakeCancellation() const { return context_.MakeCancellation(); }
  // A wait that ends with the call. Must be called before the reactor is given to gRPC, if at all.
  RevisionWait& StartWait() { return wait_.emplace(); }

  // Charges for a part of the answer, of about this many bytes when it is encoded, before it is
  // made. RESOURCE_EXHAUSTED if the answer would be larger than --max_message_bytes, or for want of
  // memory.
  absl::Status ReserveAnswer(int64_t bytes);
  // Adds advice to the error of an answer that is too large. The text must outlive the call.
  void set_advice(absl::string_view advice) { advice_ = advice; }
  // The bytes that were reserved.
  int64_t answer_bytes() const { return answer_bytes_; }
  // Forgets an answer that is to be made anew.
  void ForgetAnswer();

  // Ends the call; with the response, if the status is OK and there is memory for it until it is
  // sent. Frees the messages. Must be called exactly once. With the error of NotOwnerError the
  // owner of the map gets the request instead, and its answer ends the call.
  void Finish(absl::Status status, int64_t items = 0);

  // The account of the memory that the call's work takes.
  CallTicket& ticket() { return context_.ticket(); }

 protected:
  // The context lives as long as this.
  UnaryCall(const CallFacilities& facilities, grpc::CallbackServerContext* context, Rpc rpc,
            const RawMessages& raw);

  // Keeps the call, which is this one, until gRPC is done with it.
  void KeepUntilDone(std::shared_ptr<UnaryCall> call) { self_ = std::move(call); }
  absl::Status EnterMap(std::string map) { return context_.EnterMap(std::move(map)); }
  absl::Status EnterSourceMap(std::string map) { return context_.EnterSourceMap(std::move(map)); }
  void Refuse(const absl::Status& status) { admitted_ = status; }
  const RawMessages& raw() const { return raw_; }

 private:
  // Its reactions are short, so that gRPC may run them on any of its threads.
  class Reactor final : public grpc::ServerUnaryReactor {
   public:
    explicit Reactor(UnaryCall* call) : call_(*call) {}
    void OnCancel() override;
    void OnDone() override;
    bool InternalInlineable() override { return true; }

   private:
    UnaryCall& call_;
  };

  // Fills the request, which is empty until then.
  virtual absl::Status Parse() = 0;
  virtual void ClearResponse() = 0;
  virtual grpc::Slice EncodeResponse() = 0;
  virtual void FreeMessages() = 0;

  // Frees the messages, and what is charged.
  void FreeAll();
  // Charges for the encoded response until gRPC has sent it; drops it if there is no memory.
  absl::Status ChargeResponse();
  // Gives the request to the owner of the map.
  void PassOn(Forwarding forwarding);

  Reactor reactor_;
  CallContext context_;
  const RawMessages raw_;
  const int64_t max_answer_bytes_;
  absl::Status admitted_;
  bool is_parsed_ = false;
  std::optional<RevisionWait> wait_;
  absl::string_view advice_;
  int64_t answer_bytes_ = 0;         // reserved
  int64_t answer_charge_ = 0;        // charged for them
  std::shared_ptr<UnaryCall> self_;  // until OnDone
};

using UnaryCallPtr = std::shared_ptr<UnaryCall>;

// A unary call with its messages. The memory of a request is charged before it is parsed. A small
// request is parsed when the call begins, a large one by AnswerOn and StartOn on their worker. The
// messages are on an arena: an answer consists of many small ones, and there, allocating one moves
// a pointer, and freeing costs nothing. The arena begins with a block of `kBytes`, which is enough
// for the usual request and answer.
template <typename Request, typename Response>
class UnaryCallOf final : public UnaryCall {
 public:
  // A call whose request is not `acceptable` is refused.
  static std::shared_ptr<UnaryCallOf> Begin(const CallFacilities& facilities,
                                            grpc::CallbackServerContext* context, Rpc rpc,
                                            const RawMessages& raw,
                                            const absl::Status& acceptable) {
    auto call = std::make_shared<UnaryCallOf>(Private(), facilities, context, rpc, raw, acceptable);
    call->KeepUntilDone(call);
    if (call->admitted().ok() && IsSmallRequest(*raw.request)) {
      if (const absl::Status parsed = call->EnsureParsed(); !parsed.ok()) call->Refuse(parsed);
    }
    return call;
  }

  class Private {
    friend class UnaryCallOf;
    Private() = default;
  };
  UnaryCallOf(Private, const CallFacilities& facilities, grpc::CallbackServerContext* context,
              Rpc rpc, const RawMessages& raw, const absl::Status& acceptable)
      : UnaryCall(facilities, context, rpc, raw) {
    ticket().Received(*raw.request);
    if (!admitted().ok()) return;
    absl::Status status = acceptable;
    if (status.ok()) status = ticket().ChargeArrival(Request::default_instance(), *raw.request);
    if (!status.ok()) Refuse(status);
  }

  // The messages live until Finish. The request is empty while it is not parsed.
  const Request& request() const { return *request_; }
  // Asks for at least the revision that was waited for. Before the answer begins.
  void AskFor(Revision revision) { AskForRevision(revision, request_); }
  Response* response() { return response_; }

 private:
  static constexpr size_t kBytes = 2048;

  absl::Status Parse() override {
    HYPERMAP_RETURN_IF_ERROR(ticket().ChargeRest(Request::default_instance(), *raw().request));
    HYPERMAP_RETURN_IF_ERROR(ParseRequest(*raw().request, request_));
    HYPERMAP_RETURN_IF_ERROR(EnterMap(MapOf(*request_)));
    return EnterSourceMap(SourceMapOf(*request_));
  }
  void ClearResponse() override { response_->Clear(); }
  grpc::Slice EncodeResponse() override { return Serialize(*response_); }
  void FreeMessages() override { arena_.Reset(); }

  alignas(std::max_align_t) char block_[kBytes];
  google::protobuf::Arena arena_{block_, sizeof block_};
  Request* const request_ = google::protobuf::Arena::CreateMessage<Request>(&arena_);
  Response* const response_ = google::protobuf::Arena::CreateMessage<Response>(&arena_);
};

// Begins a unary call, whose request is refused if it is not `acceptable`.
template <typename Request, typename Response>
std::shared_ptr<UnaryCallOf<Request, Response>> BeginCall(const CallFacilities& facilities,
                                                          grpc::CallbackServerContext* context,
                                                          Rpc rpc, const RawMessages& raw,
                                                          const absl::Status& acceptable) {
  return UnaryCallOf<Request, Response>::Begin(facilities, context, rpc, raw, acceptable);
}

// The same for a request of at most FixedLimits::kMaxRequestBytes.
template <typename Request, typename Response>
std::shared_ptr<UnaryCallOf<Request, Response>> BeginCall(const CallFacilities& facilities,
                                                          grpc::CallbackServerContext* context,
                                                          Rpc rpc, const RawMessages& raw) {
  return BeginCall<Request, Response>(
      facilities, context, rpc, raw, CheckRequestSize(*raw.request, FixedLimits::kMaxRequestBytes));
}

// Reserves room for a part of the answer that was just made, before the next one is; the most that
// is in memory without a charge is one part. Errors of ReserveAnswer and of the call's
// cancellation.
absl::Status ReservePart(UnaryCall& call, const google::protobuf::Message& part);

// The number of calls about one map that a pool answers at a time.
enum class Turns { kNone, kOnePerMap };

// Parses the request on a worker, if it is not parsed yet, and runs `answer` there; then ends the
// call. `answer` fills the response and returns the number of items in it. It is not run if the
// call was cancelled or its deadline has passed. A call that is not admitted ends at once, here and
// below. `answer` has the call's Cancellation; once that has reported an error, the call ends with
// it, whatever `answer` returns. With Turns::kOnePerMap, the calls about a map are answered one at
// a time, as tasks about one subject by WorkerPool::Run.
grpc::ServerUnaryReactor* AnswerOn(WorkerPool* workers, UnaryCallPtr call,
                                   absl::AnyInvocable<absl::StatusOr<int64_t>() &&> answer,
                                   Turns turns = Turns::kNone);

// Parses the request on a worker, if it is not parsed yet, and runs `start` there. If it returns an
// error, the call ends with it; otherwise `start` has made sure that the call is ended later.
// `start` has the call's Cancellation, too.
grpc::ServerUnaryReactor* StartOn(WorkerPool* workers, UnaryCallPtr call,
                                  absl::AnyInvocable<absl::Status() &&> start);
// As StartOn, but on gRPC's thread; for short tasks. REQUIRES: the call is not admitted, or its
// request is parsed.
grpc::ServerUnaryReactor* StartAtOnce(const UnaryCallPtr& call,
                                      absl::AnyInvocable<absl::Status() &&> start);

// Hands a batch to the map's writer. When it is on disk, `respond` fills the response from the
// receipt, and the call ends. `request_digest` is that of DigestOf.
void SubmitAndFinish(UnaryCallPtr call, MapSession& session, EditBatch batch,
                     const std::string& request_id, std::string request_digest,
                     absl::AnyInvocable<void(const storage::Receipt&) &&> respond);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_UNARY_CALL_H_
