// The poses of a fused layer's observations, smoothed.
#ifndef HYPERMAP_SERVER_SESSION_POSE_SMOOTHING_H_
#define HYPERMAP_SERVER_SESSION_POSE_SMOOTHING_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "map/observations/pose_correction.h"
#include "server/session/map_session.h"

namespace hypermap::server {

// Bounds of memory and time: of a layer with more observations the newest ones are smoothed. With
// depth images of 80 x 60 pixels these are about 2,500, which one robot sends in 8 minutes at 5 Hz.
inline constexpr size_t kMaxSmoothedObservations = 5'000;
inline constexpr int64_t kMaxSmoothedBytes = int64_t{128} << 20;

struct SmoothedPoses {
  std::string frame_id;  // The layer's frame, in which the corrections are.
  // Of the robots some of whose observations are to be moved. Empty if all are where they should
  // be.
  std::vector<PoseCorrection> corrections;
  int64_t matched = 0;       // Observations that were matched to others.
  int64_t moved = 0;         // Observations that the corrections move.
  double rms_shift_m = 0.0;  // From the poses that were told, of the observations that are moved.
  std::string occupancy_layer;  // Whose walls were used; empty if none were.
};

// Reads the layer's observations, and computes better poses for them (map/smoothing), on the
// caller's thread; the log is read in parts, so that the map's writer is never blocked for long.
// Begins with the poses that robots told, also by CorrectPoses, so that the result does not depend
// on earlier ones. Takes the memory of the observations' surfaces from the meter of this thread.
// `occupancy_layer` may be empty: the map's only occupancy grid. `check_wanted` is
// called now and then, and its error ends the work. NOT_FOUND if there is no such layer;
// INVALID_ARGUMENT if `occupancy_layer` is no occupancy grid; errors as MapSession::InspectFusion.
absl::StatusOr<SmoothedPoses> SmoothPoses(MapSession& session, const std::string& layer,
                                          const std::string& occupancy_layer,
                                          const std::function<absl::Status()>& check_wanted);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_SESSION_POSE_SMOOTHING_H_
