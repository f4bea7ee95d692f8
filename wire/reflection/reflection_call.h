// One ServerReflectionInfo rpc.
#ifndef HYPERMAP_WIRE_REFLECTION_REFLECTION_CALL_H_
#define HYPERMAP_WIRE_REFLECTION_REFLECTION_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "base/sync/mutex.h"
#include "wire/reflection/served_schema.h"
#include "wire/reflection/ticket.h"

namespace hypermap::reflection {

class ReflectionCall;

// The registry of all streams that are under way. Thread safe.
class OpenReflectionCalls {
 public:
  OpenReflectionCalls() = default;
  // gRPC's shutdown has waited for the last Remove; the lock lets ThreadSanitizer see that.
  ~OpenReflectionCalls() { const MutexLock lock(&mutex_); }

  // Returns false, without adding the call, if the server is stopping.
  bool Add(ReflectionCall* call);
  void Remove(ReflectionCall* call);
  // Ends all calls, and refuses new ones.
  void Stop();

 private:
  Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::set<ReflectionCall*> calls_ ABSL_GUARDED_BY(mutex_);
};

// Answers one request after another on gRPC's threads, and reads the next request when the answer
// was written. So an open stream takes no thread, and a client that does not read its answers costs
// the memory of one. That memory is charged before the request is parsed. Deletes itself in OnDone,
// which gRPC calls after Finish, when no operation is under way.
class ReflectionCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // A longer request ends the stream with RESOURCE_EXHAUSTED. Names of symbols and files have some
  // dozens of bytes.
  static constexpr size_t kMaxRequestBytes = size_t{64} << 10;
  // The memory of a shorter request is not charged.
  static constexpr size_t kFreeBytes = size_t{1} << 10;

  // `schema` and `calls` must outlive this; the context lives until OnDone.
  ReflectionCall(const grpc::CallbackServerContext* context, std::unique_ptr<Ticket> ticket,
                 ServedSchema* schema, OpenReflectionCalls* calls);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  // Ends the call after the answer that is being written.
  void End(const absl::Status& status);

 private:
  // The same for a caller that holds the lock.
  void EndLocked(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Makes answer_ of request_, which it frees.
  absl::Status Answer() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const grpc::CallbackServerContext* const context_;
  ServedSchema* const schema_;
  OpenReflectionCalls* const calls_;

  // gRPC uses these two without mutex_.
  grpc::ByteBuffer request_;  // Written by gRPC while a read is under way.
  grpc::ByteBuffer answer_;   // Read by gRPC while a write is under way.

  Mutex mutex_;
  const std::unique_ptr<Ticket> ticket_ ABSL_PT_GUARDED_BY(mutex_);
  int64_t charged_ ABSL_GUARDED_BY(mutex_) = 0;
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;  // No more requests are read.
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::reflection

#endif  // HYPERMAP_WIRE_REFLECTION_REFLECTION_CALL_H_
