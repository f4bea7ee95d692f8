// One robot's stream of frames.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_

#include <grpcpp/support/server_callback.h>

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "hypermap/v1/frame_service.pb.h"
#include "ingest/frame_service/frame_decode.h"
#include "ingest/frame_service/frame_server.h"

namespace hypermap::ingest {

// What the calls of a server share, and how many there are.
struct FrameCalls {
  FrameServerOptions options;
  client::Client client;
  std::shared_ptr<const Observer> observer;

  // Not absl's, which ThreadSanitizer can't see unless abseil is built with it.
  std::mutex mutex;
  std::condition_variable ended;
  int running = 0;  // guarded by the mutex
};

// Requests come in on gRPC's threads and wait in a bounded queue; one thread of the call works them
// and sends observations on, another hands acknowledgements back. gRPC owns the object from its
// making to OnDone.
class FrameCall
    : public grpc::ServerBidiReactor<v1::StreamFramesRequest, v1::StreamFramesResponse> {
 public:
  explicit FrameCall(std::shared_ptr<FrameCalls> calls);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

 private:
  // Works the call to its end, in a thread of its own.
  static void Run(FrameCall* call, std::shared_ptr<FrameCalls> calls);
  absl::Status Serve();
  void Work(client::ObserveStream& upstream);
  void PassAcknowledgements(client::ObserveStream& upstream);
  void TellOpened(const client::OpenedLayer& opened);
  // The next frame; nullopt when no more come or the call ends.
  std::optional<v1::RobotFrame> Pop();

  // The mutex is held for these.
  bool MayPop() const;
  void Push(v1::RobotFrame frame);
  bool Full() const;
  void Acknowledge(int64_t sequence, v1::FrameOutcome outcome, Revision revision,
                   const std::string& message);
  // Sends what waits to be sent; at the end, the status.
  void Flush();

  void End(const absl::Status& status);

  const std::shared_ptr<FrameCalls> calls_;
  FrameSource source_;        // set before the thread begins
  bool drop_oldest_ = false;  // as well

  // Guards what follows, but for the two messages.
  std::mutex mutex_;
  std::condition_variable may_pop_;
  v1::StreamFramesRequest request_;   // gRPC writes to it while a read is out
  v1::StreamFramesResponse sending_;  // gRPC reads it while a write is out
  bool opened_ = false;
  std::deque<v1::RobotFrame> queue_;
  bool input_ended_ = false;
  bool upstream_ended_ = false;
  bool cancelled_ = false;
  bool read_paused_ = false;
  client::ObserveStream* upstream_ = nullptr;
  std::map<int64_t, int> bad_instances_;  // by sequence
  v1::StreamFramesResponse waiting_;
  bool writing_ = false;
  bool finished_ = false;
  std::optional<absl::Status> end_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_CALL_H_
