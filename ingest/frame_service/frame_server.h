// Serves FrameService: receives frames of robots and sends observations to a Hypermap server.
#ifndef HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_
#define HYPERMAP_INGEST_FRAME_SERVICE_FRAME_SERVER_H_

#include <cstdint>
#include <functional>
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
  // Bytes of memory of the frames that wait in a stream at which its queue is full, too.
  int64_t max_queue_bytes = int64_t{32} << 20;
  int max_instances = 254;
  // Enough for the depth of the largest camera (kMaxStreamedSide), two bytes for each pixel, and
  // its instances.
  int max_message_bytes = (32 + 8) << 20;
  // Streams that may be open at once; half of them for one client address. All share one
  // connection to the Hypermap server, and each has two threads.
  int max_streams = 256;
  admission::ConnectionLimits connections = {};
  // Bytes of memory that all streams may take together; half of them for one client address.
  int64_t memory_limit = int64_t{4} << 30;
  // While more memory is resident, the connections that receive the most are shut down; 0: never.
  int64_t max_resident_bytes = 0;
  // Takes lines for the log: about refusals and connections that were shut down, at most one of a
  // kind in 10 s. Any thread may call it.
  std::function<void(const std::string& line)> log = [](const std::string&) {};
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
