// Records a stretch of a map's history as an MCAP file of ROS 2 (docs/ros2.md).
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_HISTORY_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_HISTORY_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/mcap/mcap_writer.h"
#include "client_libs/ros2/recording/map_recorder.h"

namespace hypermap::ros2 {

struct HistoryOptions {
  std::string map;
  std::vector<std::string> layers = {};               // empty: all
  absl::Duration timeout = absl::InfiniteDuration();  // of a call
  // Absent: the first revision that can be recorded, but not the empty map before revision 1.
  std::optional<Revision> from = std::nullopt;
  std::optional<Revision> to = std::nullopt;  // absent: the newest
  RecorderOptions recorder = {};
};

// The revisions that were recorded.
struct RecordedHistory {
  Revision oldest = 0;  // that is kept
  Revision from = 0;
  Revision to = 0;
};

// Records the state at `from`, and what each revision after it changes, up to `to`. The log time of
// a message is the time at which its revision was made. Later changes of the map do not matter.
//
// INVALID_ARGUMENT if `to` is before `from`; NOT_FOUND for a map, or a layer that does not occur in
// these revisions; OUT_OF_RANGE for revisions that are not there, or whose layers and frames the
// server does not tell any more (FindPastStructure); ABORTED if the map is deleted and made anew
// meanwhile; errors of `sink`. After an error the file is incomplete.
absl::StatusOr<RecordedHistory> RecordHistory(client::Client& client, const HistoryOptions& options,
                                              McapWriter::Sink sink);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_HISTORY_H_
