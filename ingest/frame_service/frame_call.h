// The call StreamFrames: one robot's stream of frames.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "base/admission/budget.h"
#include "base/admission/refusals.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/frame_service.pb.h"
#include "ingest/frame_service/frame_decode.h"
#include "ingest/frame_service/frame_server.h"

namespace hypermap::ingest {

// State that all calls of a server share.
struct FrameCalls {
  FrameCalls(const FrameServerOptions& options, const client::Client& client,
             std::shared_ptr<const Observer> observer);

  const FrameServerOptions options;
  client::Client client;
  const std::shared_ptr<const Observer> observer;
  admission::Budget memory;   // --memory_limit
  admission::Budget streams;  // --max_streams
  admission::Refusals refusals;

  Mutex mutex;
  CondVar ended;
  int running ABSL_GUARDED_BY(mutex) = 0;  // Number of calls with a thread.
};

// Requests arrive on gRPC's threads and wait in a bounded queue. One thread of the call turns them
// into observations and sends these to the server; another returns the server's acknowledgements.
// If the queue is full, reading pauses, so that gRPC's flow control slows the robot down, unless
// the robot has asked to drop its oldest frame. Reading also pauses while many acknowledgements
// wait for a robot that does not read them.
//
// Memory is charged before it is taken: that of a message before it is parsed, until its frame is
// done; that of the masks before they are decoded; and at the opening that of perception. A call
// whose charge is refused ends with RESOURCE_EXHAUSTED. The object deletes itself in OnDone().
class FrameCall : public grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  // Acknowledgements that may wait before reading pauses.
  static constexpr int kMaxWaitingAcknowledgements = 1000;

  // The stream and the memory of its frames are charged to `client`, an address as gRPC writes it.
  FrameCall(std::shared_ptr<FrameCalls> calls, absl::string_view client);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  struct WaitingFrame {
    v1::RobotFrame frame;
    int64_t bytes;  // charged
  };

  // Serves the call to its end, on a thread of its own.
  static void Run(FrameCall* call, const std::shared_ptr<FrameCalls>& calls);
  absl::Status Serve();
  // Processes frames until no more come, and returns OK, or the error with which the call must end.
  absl::Status Work(client::ObserveStream& upstream);
  // Sends the observation of the frame, or acknowledges that it is not valid. Returns false if the
  // stream to the server broke.
  bool Process(const v1::RobotFrame& frame, client::ObserveStream& upstream);
  absl::StatusOr<Observation> Observe(const v1::RobotFrame& frame, int& bad_instances) const;
  void PassAcknowledgements(client::ObserveStream& upstream);
  void TellOpened(const client::OpenedLayer& opened);
  // Waits for the next frame; nullopt if no more come or the call ends.
  std::optional<WaitingFrame> Pop();
  // OK, or CANCELLED if nobody waits for the frames any more.
  absl::Status CheckWanted();
  // Charges memory of a frame, for which `held` bytes are charged already. Returns the error of
  // Budget::Charge::Add, and none of TryLater if there is no room for the frame even when nothing
  // else is charged.
  absl::Status Charge(int64_t bytes, int64_t held = 0);
  void Free(int64_t bytes);

  // Parses request_ and handles the message. An error ends the call.
  absl::Status TakeRequest();
  // Takes the stream's opening and starts the thread of the call. Returns INVALID_ARGUMENT or
  // RESOURCE_EXHAUSTED, and starts none, if the stream can't be opened so.
  absl::Status Open(const v1::StreamFramesRequest& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Takes a request after the opening, whose parsed form was charged with this many bytes.
  void TakeFrame(v1::StreamFramesRequest& request, int64_t bytes)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool MayPop() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Push(WaitingFrame waiting) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Takes the oldest frame from the queue.
  WaitingFrame TakeOldest() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Full() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Starts the next read, unless one is running or must wait.
  void ReadOn() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Returns the acknowledgement, which is not sent before the next Flush. Long messages are cut.
  v1::FrameAcknowledgement* Add(int64_t sequence, v1::FrameOutcome outcome, Revision revision,
                                const std::string& message) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Acknowledge(int64_t sequence, v1::FrameOutcome outcome, const std::string& message)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Starts writing waiting_, unless a write is running; finishes the call once nothing waits and
  // its status is known.
  void Flush() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  void End(const absl::Status& status);
  void EndLocked(const absl::Status& status) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const std::shared_ptr<FrameCalls> calls_;
  FrameSource source_;        // Set before the thread begins.
  bool drop_oldest_ = false;  // Set before the thread begins.

  // gRPC uses these two without mutex_.
  grpc::ByteBuffer request_;  // Written by gRPC while a read is running.
  grpc::ByteBuffer sending_;  // Read by gRPC while a write is running.

  Mutex mutex_;
  CondVar may_pop_;
  admission::Budget::Charge stream_ ABSL_GUARDED_BY(mutex_);
  admission::Budget::Charge memory_ ABSL_GUARDED_BY(mutex_);
  int64_t bytes_of_camera_ ABSL_GUARDED_BY(mutex_) = 0;  // Charged until the end.
  bool opened_ ABSL_GUARDED_BY(mutex_) = false;
  bool told_opened_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<WaitingFrame> queue_ ABSL_GUARDED_BY(mutex_);
  int64_t queued_bytes_ ABSL_GUARDED_BY(mutex_) = 0;
  bool reading_ ABSL_GUARDED_BY(mutex_) = false;
  bool input_ended_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status input_status_ ABSL_GUARDED_BY(mutex_);  // Why no more requests are taken.
  bool upstream_ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  client::ObserveStream* upstream_ ABSL_GUARDED_BY(mutex_) = nullptr;
  // By sequence, of frames without acknowledgement.
  std::map<int64_t, int> bad_instances_ ABSL_GUARDED_BY(mutex_);
  v1::StreamFramesResponse waiting_ ABSL_GUARDED_BY(mutex_);
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  std::optional<absl::Status> end_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_
