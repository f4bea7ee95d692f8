// Writes successive states of a map as the messages that hypermap-ros2 publishes (docs/ros2.md).
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_MAP_RECORDER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_MAP_RECORDER_H_

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "client_libs/ros2/recording/bag_writer.h"
#include "map/layers/grid_layer.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

struct RecorderOptions {
  // The layer of /map. Empty: the first occupancy layer by name.
  std::string occupancy_layer;
  // A grid with at most so many cells is written whole whenever it changes. Of a larger one the
  // cells that change are written (TOPIC_updates), and the whole grid when the updates have had as
  // many cells as the grid.
  int64_t whole_grid_cells = 1'000'000;
};

// The messages of the first state tell all of it, and those of each further state what differs from
// the one before. Memory: two states of the map, which share what is the same, and a message. Used
// by one thread. Errors are those of BagWriter.
class MapRecorder {
 public:
  // `bag` must outlive this.
  MapRecorder(BagWriter* bag, RecorderOptions options) : bag_(bag), options_(std::move(options)) {}

  // Writes a state of the map, which it had from `time` on.
  absl::Status Record(SnapshotPtr snapshot, absl::Time time);
  // Writes whole the grids that end with updates, so that the last whole grids are the last state.
  absl::Status End();

 private:
  // A grid topic as it was recorded.
  struct RecordedGrid {
    std::shared_ptr<const GridLayer> layer;
    bool has_cells = false;     // The last whole grid was not empty.
    int64_t updated_cells = 0;  // In the updates since then.
  };

  absl::Status RecordGrids(const Snapshot& snapshot, absl::Time time);
  absl::Status RecordGrid(const std::string& topic, std::shared_ptr<const GridLayer> layer,
                          absl::Time time);
  absl::Status WriteWhole(const std::string& topic, RecordedGrid* grid, absl::Time time);
  absl::Status EndGrid(const std::string& topic, const RecordedGrid& grid, absl::Time time);
  // `has_moved`: frames are elsewhere than before, or the state is the first.
  absl::Status RecordObjects(const Snapshot& snapshot, bool has_moved, absl::Time time);

  BagWriter* const bag_;
  const RecorderOptions options_;
  bool has_begun_ = false;
  SnapshotPtr recorded_ = std::make_shared<const Snapshot>();  // empty at first
  absl::Time time_;                                            // of recorded_
  std::map<std::string, RecordedGrid> grids_;                  // by topic
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_MAP_RECORDER_H_
