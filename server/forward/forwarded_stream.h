// A stream that is passed on to another server.
#ifndef HYPERMAP_SERVER_FORWARD_FORWARDED_STREAM_H_
#define HYPERMAP_SERVER_FORWARD_FORWARDED_STREAM_H_

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/client_callback.h>

#include <cstdint>
#include <memory>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "base/metering/memory_meter.h"
#include "base/sync/mutex.h"
#include "server/forward/forwarder.h"

namespace hypermap::server {

// Passes the messages of a stream on between its caller and another server, one at a time in each
// direction: the next is read when the last was taken. So whoever does not read delays only the
// stream, which holds two messages. Their memory is charged while they wait.
//
// Both ends are reactors of gRPC's. The one of the caller owns this, implements Caller, and tells
// what has become of its reads and writes.
class ForwardedStream final : private grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                              private Forwarder::UnderWay {
 public:
  // Messages up to this size are not charged: --max_calls bounds them.
  static constexpr int64_t kFreeBytes = 1 << 10;

  class Caller {
   public:
    // Reads the caller's next message; OnCallerRead must follow. Not called for Requests::kOne.
    virtual void ReadFromCaller(grpc::ByteBuffer* message) = 0;
    // Writes a message, which lives until OnCallerWritten, which must follow.
    virtual void WriteToCaller(grpc::ByteBuffer* message) = 0;
    // Ends the stream. The last call, when no write is under way; a read may be. May delete the
    // ForwardedStream.
    virtual void EndForwarded(const ForwardedEnd& end) = 0;

   protected:
    ~Caller() = default;
  };
  // How many messages the caller sends.
  enum class Requests { kOne, kMany };

  // Both pointers must outlive this. The account is used by one thread at a time, from Start to
  // EndForwarded.
  ForwardedStream(Caller* caller, MemoryAccount* account, Requests requests, Forwarding forwarding);
  ForwardedStream(const ForwardedStream&) = delete;
  ForwardedStream& operator=(const ForwardedStream&) = delete;

  // Opens the stream there, and sends the message that the caller sent first, which was read before
  // it was known that the stream is passed on. The caller has no read and no write under way.
  void Start(const grpc::ByteBuffer& first);

  // A read or write of the caller has ended. Later reads are ignored once the other server has
  // ended the stream.
  void OnCallerRead(bool ok);
  void OnCallerWritten(bool ok);

  // Ends the stream with this error. Any thread may call it.
  void Stop(const absl::Status& status) override;

 private:
  void OnWriteDone(bool ok) override;
  void OnReadDone(bool ok) override;
  void OnDone(const grpc::Status& status) override;

  absl::Status Charge(const grpc::ByteBuffer& message) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Free(grpc::ByteBuffer* message) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Ends the answers, and the requests, too, if the caller is about to send the next one. Returns
  // the number of holds to remove.
  int EndAnswers() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Must be called without the lock: OnDone may follow at once.
  void RemoveHolds(int holds);

  Caller* const caller_;
  MemoryAccount* const account_;
  const Requests requests_;
  Forwarder* const forwarder_;
  const ForwardedCall call_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<grpc::ClientContext> context_;
  grpc::ByteBuffer request_;  // on its way to the server, or target of the read under way
  grpc::ByteBuffer answer_;   // on its way to the caller, or target of the read under way

  // Each direction has a hold on the reactor until it has ended, because its next operation is
  // begun by the other reactor.
  Mutex mutex_;
  bool requests_ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool answers_ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool reads_from_caller_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status stopped_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_FORWARD_FORWARDED_STREAM_H_
