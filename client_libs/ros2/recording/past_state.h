// The state of a map at a revision in the midst of its history, as far as a server tells it.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_PAST_STATE_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_PAST_STATE_H_

#include <vector>

#include "absl/status/statusor.h"
#include "client_libs/cpp/client.h"
#include "client_libs/ros2/recording/follow.h"
#include "map/frames/frame_tree.h"
#include "map/layers/layer_spec.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

// A layer as it was, and where it may have content.
struct PastLayer {
  LayerSpec spec;
  CellBox extent;  // Of a grid: a box that contains the one of that time.
};

// The layers and frames that a map had at `since` and, but for new layers, in all revisions after.
struct PastStructure {
  Revision since = 0;
  std::vector<PastLayer> layers;
  std::vector<FrameTransform> transforms;
};

// Finds the layers and frames of `revision`. The server lists those of the newest revision only,
// and the changes after `revision` tell which layers are new. They do not tell how frames were
// before they were moved, nor what layers were that have been deleted: if there are such changes,
// the result is the structure since the last one, which is later than `revision`. Reads all changes
// after `revision`. DATA_LOSS for a layer that the server can't read.
absl::StatusOr<PastStructure> FindPastStructure(client::Client& client, const HistoryScope& scope,
                                                Revision revision);

// Asks for the content at the revision structure.since. OUT_OF_RANGE if that is no longer kept.
absl::StatusOr<SnapshotPtr> FetchPastState(client::Client& client, const HistoryScope& scope,
                                           const PastStructure& structure);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_PAST_STATE_H_
