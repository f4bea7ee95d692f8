// Reads a stretch of a map's history from a server.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_FOLLOW_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_FOLLOW_H_

#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"

namespace hypermap::ros2 {

// The part of a map that is read. Calls are ABORTED if the map is another incarnation.
struct HistoryScope {
  client::MapEntry map;
  std::vector<std::string> layers;                    // empty: all
  absl::Duration timeout = absl::InfiniteDuration();  // of a call
};

// Calls `take` for each event of Client::Replicate after the revision `begin`, until it has taken
// one of `end` or a later revision. The first event has no changes, and is of `begin`. Returns the
// error of `take`; OUT_OF_RANGE if `begin` is not kept; other errors of the server.
absl::Status Follow(client::Client& client, const HistoryScope& scope, Revision begin, Revision end,
                    absl::FunctionRef<absl::Status(const client::WatchEvent&)> take);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_FOLLOW_H_
