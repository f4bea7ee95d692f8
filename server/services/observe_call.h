// One Observe rpc.
#ifndef HYPERMAP_SERVER_SERVICES_OBSERVE_CALL_H_
#define HYPERMAP_SERVER_SERVICES_OBSERVE_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/metering/memory_meter.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "map/observations/observe_answers.h"
#include "server/forward/forwarded_stream.h"
#include "server/rpc/call_context.h"
#include "server/rpc/call_ticket.h"
#include "server/rpc/facilities.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Reads requests while fewer than kMaxInFlight, of fewer than kMaxUnansweredBytes, are unanswered,
// and while the answers that are not written yet take less than kMaxUnwrittenBytes. Charges both to
// --max_request_bytes, which ends the call if there is no more. Decodes and submits the requests
// one after the other on a worker, in the order of the stream. A response contains all
// acknowledgements that are ready when the previous one was written. So a caller that sends faster
// than the disk writes, or does not read its answers, delays nobody but itself. Deletes itself in
// OnDone, which gRPC calls after Finish, when no operation is under way.
//
// If another server owns the map, the messages are passed on to that one, and its answers are the
// answers.
class ObserveCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>,
                          private EndableStream,
                          private ForwardedStream::Caller {
 public:
  // `facilities` and `open` must outlive this; the context lives until OnDone.
  ObserveCall(grpc::CallbackServerContext* context, const Facilities* facilities,
              OpenStreams* open);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override {
    open_->Remove(this);
    ticket_.LookForCancellation();
    delete this;
  }

 private:
  void EndSoon() override;

  static constexpr int kMaxInFlight = 32;
  static constexpr int64_t kMaxUnansweredBytes = 4 << 20;
  // 2,000 acknowledgements or more: the encoded ones take less.
  static constexpr int64_t kMaxUnwrittenBytes = 1 << 20;

  struct RequestSize {
    int64_t bytes;
    int64_t cost;  // charged
  };

  // These run on a worker, or on the map's writer, for one request at a time.
  void TakeRequest(const grpc::ByteBuffer& bytes);
  // Ends the taking of a request: submits its observations, or ends it with the error.
  void Took(const v1::ObserveRequest& request, absl::Status status);
  // Makes the layer a fused one, and goes on when that is on disk.
  void Open(std::shared_ptr<const v1::ObserveRequest> request);
  // Tells the client what the layer has of the robot.
  absl::Status TellOpened(const std::string& robot);
  // Reads the answer to the opening on the map's writer, which takes its memory from the meter.
  absl::StatusOr<OpenedLayer> ReadOpened(const std::string& robot, MemoryMeter* meter);
  absl::Status Submit(const v1::ObserveRequest& request);
  // OK also for no name, which is an error of its own where one is needed.
  absl::Status CheckRobot(const std::string& robot) const;

  // These run on the writer's thread or a worker. `bytes` are charged for the acknowledgements.
  void Answer(const absl::StatusOr<std::vector<ObservationVerdict>>& verdicts,
              std::vector<ObservationVerdict> invalid, int64_t bytes);
  void EndRequest(absl::Status status);

  // Charges the arrival of the request that was read; the error ends the call.
  absl::Status ChargeRequest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Charges the rest, before the request is parsed.
  absl::Status ChargeRest(const grpc::ByteBuffer& bytes);
  // Gives back the charge of the oldest request.
  void FreeRequest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Charges acknowledgements before their observations are submitted, and the answer to the opening
  // before it is made, until they are written; the error ends the call.
  absl::Status ChargeAnswer(int64_t bytes);
  void FreeAnswer(int64_t bytes) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  // Passes the stream on instead of ending it with this error. Returns false if it must end.
  bool PassOn(const absl::Status& error);
  // The stream that is passed on; null if it is not.
  ForwardedStream* forwarded();
  void ReadFromCaller(grpc::ByteBuffer* message) override;
  void WriteToCaller(grpc::ByteBuffer* message) override { StartWrite(message); }
  void EndForwarded(const ForwardedEnd& end) override { Finish(context_.End(end)); }

  // Changes the state under the lock, then starts the operations that the new state allows: a read,
  // a write, or the end of the call.
  void Change(absl::FunctionRef<void()> change);
  // Starts a read and a write if possible. Returns whether the call must be finished.
  bool GoOn() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const Facilities* const facilities_;
  OpenStreams* const open_;
  CallContext context_;
  CallTicket& ticket_;  // of context_

  // Set by the first request, before others are read.
  std::shared_ptr<MapSession> session_;
  std::string layer_;
  std::string author_;

  grpc::ByteBuffer first_;    // the first request, until it has opened the stream
  grpc::ByteBuffer read_;     // target of the read under way
  grpc::ByteBuffer written_;  // source of the write under way

  Mutex mutex_;
  v1::ObserveResponse next_ ABSL_GUARDED_BY(mutex_);  // answers for the next write
  bool has_next_ ABSL_GUARDED_BY(mutex_) = false;
  int in_flight_ ABSL_GUARDED_BY(mutex_) = 0;  // number of requests that are not answered yet
  std::deque<RequestSize> request_sizes_ ABSL_GUARDED_BY(mutex_);  // of these
  int64_t unanswered_bytes_ ABSL_GUARDED_BY(mutex_) = 0;           // their sum
  // Charged bytes of answers: all that are not written, and of these the ones in next_ and in
  // written_.
  int64_t unwritten_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t next_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t written_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  bool opened_ ABSL_GUARDED_BY(mutex_) = false;
  bool reading_ ABSL_GUARDED_BY(mutex_) = true;
  bool taking_ ABSL_GUARDED_BY(mutex_) = false;  // a worker has a request
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool no_more_reads_ ABSL_GUARDED_BY(mutex_) = false;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status status_ ABSL_GUARDED_BY(mutex_);
  int64_t acknowledged_ ABSL_GUARDED_BY(mutex_) = 0;
  std::unique_ptr<ForwardedStream> forwarded_ ABSL_GUARDED_BY(mutex_);
  grpc::ByteBuffer* forwarded_read_ = nullptr;  // target of the read under way for it
};

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SERVICES_OBSERVE_CALL_H_
