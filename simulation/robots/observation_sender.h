// Sends a robot's observations reliably.
#ifndef HYPERMAP_SIMULATION_ROBOTS_OBSERVATION_SENDER_H_
#define HYPERMAP_SIMULATION_ROBOTS_OBSERVATION_SENDER_H_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "client_libs/cpp/client.h"
#include "map/observations/observation.h"

namespace hypermap::robots {

// Keeps observations until they are acknowledged. If the stream breaks, it opens another and sends
// them again, so that nothing is lost if the server restarts within `patience`. For use by one
// thread.
class ObservationSender {
 public:
  struct Target {
    std::string map;
    std::string layer;
    // options.robot names the robot.
    client::ObserveOptions options;
  };
  // `client` must outlive the sender. Waiting for the server ends when `is_interrupted` returns
  // true.
  ObservationSender(client::Client& client, Target target, absl::Duration patience,
                    std::function<bool()> is_interrupted);

  // Opens the stream, and learns next_sequence() from the server.
  absl::Status Open();
  // Sequence number for the next observation: above all that the layer has of this robot.
  int64_t next_sequence() const { return next_sequence_; }

  // Sends an observation whose sequence is next_sequence(). Waits for acknowledgements if too many
  // are outstanding.
  absl::Status Send(Observation observation);
  // Waits until all observations are acknowledged. Errors, here and of Send(): UNAVAILABLE if the
  // server did not come back within `patience`; FAILED_PRECONDITION if it refused an observation;
  // CANCELLED if interrupted.
  absl::Status Flush();

  int64_t num_accepted() const { return num_accepted_; }

 private:
  // Waits for one acknowledgement; reopens the stream if it has ended.
  absl::Status AwaitOne();
  // Opens a new stream, within `patience`, and writes all pending observations to it.
  absl::Status Reopen();
  absl::Status OpenOnce();
  absl::Status Note(const client::Acknowledgement& acknowledgement);

  client::Client& client_;
  const Target target_;
  const absl::Duration patience_;
  const std::function<bool()> is_interrupted_;
  std::unique_ptr<client::ObserveStream> stream_;
  std::map<int64_t, Observation> pending_;  // By sequence.
  int64_t next_sequence_ = 0;
  int64_t num_accepted_ = 0;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_OBSERVATION_SENDER_H_
