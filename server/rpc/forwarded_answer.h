// The answer of a server stream that the owner of the map gives.
#ifndef HYPERMAP_SERVER_RPC_FORWARDED_ANSWER_H_
#define HYPERMAP_SERVER_RPC_FORWARDED_ANSWER_H_

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <utility>

#include "server/forward/forwarded_stream.h"
#include "server/rpc/call_context.h"

namespace hypermap::server {

// Belongs to the reactor that begins to answer here, and ends its call.
class ForwardedAnswer final : private ForwardedStream::Caller {
 public:
  // The pointers must outlive this.
  ForwardedAnswer(grpc::ServerWriteReactor<grpc::ByteBuffer>* reactor, CallContext* context,
                  Forwarding forwarding)
      : reactor_(reactor),
        context_(context),
        stream_(this, &context->ticket(), ForwardedStream::Requests::kOne, std::move(forwarding)) {}

  // Passes the request on. Nothing of the caller's stream may be under way or answered. Frees what
  // is charged for the call.
  void Start(const grpc::ByteBuffer& request) {
    context_->ticket().FreeMemory(context_->ticket().memory());
    stream_.Start(request);
  }
  // To be called by OnWriteDone of the reactor.
  void OnWriteDone(bool ok) { stream_.OnCallerWritten(ok); }

 private:
  void ReadFromCaller(grpc::ByteBuffer* /*message*/) override {}
  void WriteToCaller(grpc::ByteBuffer* message) override { reactor_->StartWrite(message); }
  void EndForwarded(const ForwardedEnd& end) override { reactor_->Finish(context_->End(end)); }

  grpc::ServerWriteReactor<grpc::ByteBuffer>* const reactor_;
  CallContext* const context_;
  ForwardedStream stream_;
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_FORWARDED_ANSWER_H_
