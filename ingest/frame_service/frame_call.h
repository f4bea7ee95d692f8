// The call StreamFrames: one robot's stream of frames.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_

#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "base/admission/budget.h"
#include "base/sync/mutex.h"
#include "hypermap/v1/frame_service.pb.h"
#include "ingest/frame_service/frame_decode.h"
#include "ingest/frame_service/frame_server.h"

namespace hypermap::ingest {

// State that all calls of a server share.
struct FrameCalls {
  FrameServerOptions options;
  client::Client client;
  std::shared_ptr<const Observer> observer;
  admission::Budget memory;

  Mutex mutex;
  CondVar ended;
  int running ABSL_GUARDED_BY(mutex) = 0;  // Number of calls with a thread.
};

// Requests arrive on gRPC's threads and wait in a bounded queue. One thread of the call turns them
// into observations and sends these to the server; another returns the server's acknowledgements.
// If the queue is full, reading pauses, so that gRPC's flow control slows the robot down, unless
// the robot has asked to drop its oldest frame. The object deletes itself in OnDone().
class FrameCall
    : public grpc::ServerBidiReactor<v1::StreamFramesRequest, v1::StreamFramesResponse> {
 public:
  // The memory of the stream's frames is charged to `client`.
  FrameCall(std::shared_ptr<FrameCalls> calls, absl::string_view client);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // Serves the call to its end, on a thread of its own.
  static void Run(FrameCall* call, const std::shared_ptr<FrameCalls>& calls);
  absl::Status Serve();
  void Work(client::ObserveStream& upstream);
  void PassAcknowledgements(client::ObserveStream& upstream);
  void TellOpened(const client::OpenedLayer& opened);
  // Waits for the next frame; nullopt if no more come or the call ends.
  std::optional<v1::RobotFrame> Pop();

  // Reads request_ as the stream's opening and starts the thread of the call. Returns
  // INVALID_ARGUMENT, and starts none, if it is not a valid opening.
  absl::Status Open() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool MayPop() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Push(v1::RobotFrame frame) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  bool Full() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Returns the acknowledgement, which is not sent before the next Flush.
  v1::FrameAcknowledgement* Add(int64_t sequence, v1::FrameOutcome outcome, Revision revision,
                                const std::string& message) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Acknowledge(int64_t sequence, v1::FrameOutcome outcome, Revision revision,
                   const std::string& message) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Starts writing waiting_, unless a write is running; finishes the call once nothing waits and
  // its status is known.
  void Flush() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  void End(const absl::Status& status);

  const std::shared_ptr<FrameCalls> calls_;
  admission::Budget::Charge memory_;
  FrameSource source_;        // Set before the thread begins.
  bool drop_oldest_ = false;  // Set before the thread begins.

  // gRPC uses these two messages without mutex_.
  v1::StreamFramesRequest request_;   // Written by gRPC while a read is running.
  v1::StreamFramesResponse sending_;  // Read by gRPC while a write is running.

  Mutex mutex_;
  CondVar may_pop_;
  bool opened_ ABSL_GUARDED_BY(mutex_) = false;
  std::deque<v1::RobotFrame> queue_ ABSL_GUARDED_BY(mutex_);
  bool input_ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool upstream_ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool read_paused_ ABSL_GUARDED_BY(mutex_) = false;
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
