// Serves FrameService: frames of robots in, observations out to a Hypermap server.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"
#include "ingest/perception/observer.h"

namespace hypermap::ingest {

struct FrameServerOptions {
  std::string listen = "127.0.0.1:0";  // HOST:PORT
  std::string map;
  std::string layer;
  client::ObserveOptions observe;  // but for the robot
  int queue = 16;                  // frames of a stream that wait at most
  int max_instances = 254;
  int max_message_bytes = 64 << 20;
};

// Each stream has a thread of its own that works its frames in their order, and a stream to the
// server. Thread safe.
class FrameServer {
 public:
  // UNAVAILABLE when it can't listen.
  static absl::StatusOr<std::unique_ptr<FrameServer>> Start(
      const FrameServerOptions& options, const client::Client& client,
      std::shared_ptr<const Observer> observer);
  // As Shutdown.
  ~FrameServer();

  // HOST:PORT with the port that is listened on.
  const std::string& address() const { return address_; }

  // Ends all streams and waits for them: what was not acknowledged is to be sent again.
  void Shutdown();

 private:
  struct Impl;
  FrameServer();

  std::string address_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_
