// Sends a robot's observations, and sees to it that all arrive.
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

// Keeps what is not acknowledged and sends it again, over a new stream, when the stream broke: a
// server that is started again within `patience` loses nothing. One thread.
class ObservationSender {
 public:
  struct Target {
    std::string map;
    std::string layer;
    // options.robot is the robot whose observations these are.
    client::ObserveOptions options;
  };
  // `client` must outlive it. `is_interrupted` ends the waiting for a server.
  ObservationSender(client::Client& client, Target target, absl::Duration patience,
                    std::function<bool()> is_interrupted);

  // Opens the stream. Then next_sequence() is known.
  absl::Status Open();
  // A number that the layer has of no other observation of the robot.
  int64_t next_sequence() const { return next_sequence_; }

  // `observation.sequence` is next_sequence(). Waits while too many are not acknowledged.
  absl::Status Send(Observation observation);
  // Waits until all that was sent is acknowledged.
  absl::Status Flush();

  int64_t num_accepted() const { return num_accepted_; }

 private:
  // Reads one acknowledgement; opens the stream again when there is none.
  absl::Status AwaitOne();
  // Until it is open and all that is pending was written to it, or patience is at its end.
  absl::Status Reopen();
  absl::Status OpenOnce();
  absl::Status Note(const client::Acknowledgement& acknowledgement);

  client::Client& client_;
  const Target target_;
  const absl::Duration patience_;
  const std::function<bool()> is_interrupted_;
  std::unique_ptr<client::ObserveStream> stream_;
  std::map<int64_t, Observation> pending_;  // by sequence
  int64_t next_sequence_ = 0;
  int64_t num_accepted_ = 0;
};

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_OBSERVATION_SENDER_H_
