// One Watch rpc of the health service.
#ifndef HYPERMAP_WIRE_HEALTH_WATCH_CALL_H_
#define HYPERMAP_WIRE_HEALTH_WATCH_CALL_H_

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <memory>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "wire/health/messages.h"
#include "wire/reflection/ticket.h"

namespace hypermap::health {

class Statuses;

// Sends the status of a service whenever it changes. While a message waits for a slow reader, only
// the newest status is kept, so that a stream costs the memory of one message, and no thread.
class WatchCall final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  // Returns a call that lives until OnDone; `statuses` must outlive it. It sends the status of the
  // service at once; or it ends, if `service` is an error.
  static WatchCall* Start(std::unique_ptr<reflection::Ticket> ticket,
                          const absl::StatusOr<std::string>& service, Statuses* statuses);

  // Empty if there was an error.
  const std::string& service() const { return service_; }

  // Sends the status of the service, unless that was sent last.
  void Update();
  // Ends the call after the status that is being written and the one that waits.
  void End(const absl::Status& status);

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  WatchCall(std::unique_ptr<reflection::Ticket> ticket, std::string service, Statuses* statuses);

  // Sends the status that waits, or finishes the call if it has ended, as soon as nothing is being
  // written.
  void Continue() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Ends the call of a client that receives nothing any more.
  void EndAsGone() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::string service_;
  Statuses* const statuses_;
  std::shared_ptr<WatchCall> self_;  // until OnDone
  grpc::ByteBuffer message_;         // Read by gRPC, without mutex_, while a write is under way.

  Mutex mutex_;
  std::unique_ptr<reflection::Ticket> ticket_ ABSL_GUARDED_BY(mutex_);  // until OnDone
  std::optional<ServingStatus> sent_ ABSL_GUARDED_BY(mutex_);
  std::optional<ServingStatus> waiting_ ABSL_GUARDED_BY(mutex_);  // never equal to sent_
  std::optional<absl::Status> end_ ABSL_GUARDED_BY(mutex_);
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace hypermap::health

#endif  // HYPERMAP_WIRE_HEALTH_WATCH_CALL_H_
