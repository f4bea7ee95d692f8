// Serves FrameService: receives frames of robots and sends observations to a Hypermap server.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "base/admission/open_connections.h"
#include "client_libs/cpp/client.h"
#include "ingest/perception/observer.h"

namespace hypermap::ingest {

struct FrameServerOptions {
  std::string listen = "127.0.0.1:0";  // HOST:PORT
  std::string map;
  std::string layer;
  client::ObserveOptions observe;  // All but the robot, which each stream names.
  int queue = 16;                  // Most frames that wait in each stream.
  int max_instances = 254;
  int max_message_bytes = 64 << 20;
  admission::ConnectionLimits connections = {};
  // Bytes of memory. Streams are refused whose frames would take more, of one client address more
  // than half; while more are in use, the connections that receive the most are shut down.
  int64_t memory_limit = int64_t{4} << 30;
};

// Each stream has a thread of its own, which processes its frames in order, and a stream of its own
// to the server. Thread safe.
class FrameServer {
 public:
  // Starts serving. Errors: INVALID_ARGUMENT if options.listen is not HOST:PORT; UNAVAILABLE if it
  // can't listen there.
  static absl::StatusOr<std::unique_ptr<FrameServer>> Start(
      const FrameServerOptions& options, const client::Client& client,
      std::shared_ptr<const Observer> observer);
  // Calls Shutdown().
  ~FrameServer();

  // Returns HOST:PORT with the actual port.
  const std::string& address() const { return address_; }

  // Cancels all streams and waits for their ends. Robots must resend frames that were not
  // acknowledged.
  void Shutdown();

 private:
  struct Impl;
  FrameServer();

  std::string address_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_
