// Turns frames into the observations that are sent to the server.
#ifndef HYPERMAP_INGEST_PERCEPTION_OBSERVER_H_
#define HYPERMAP_INGEST_PERCEPTION_OBSERVER_H_

#include <memory>

#include "absl/status/statusor.h"
#include "ingest/perception/frame.h"
#include "ingest/perception/segmenter.h"
#include "map/layers/grid_layer.h"
#include "map/observations/observation.h"

namespace hypermap::ingest {

struct ObserverOptions {
  // If a frame has more instances, those with the lowest scores are left out.
  int max_instances = 254;
  // Returns beyond this range are ignored in footprints, view hull and free space, metres.
  double max_range_m = 8.0;
};

// Counts of a frame's instances, of those that became detections, and of the others by the reason:
// instances = detections + without_points + suppressed.
struct FrameReport {
  int instances = 0;
  int detections = 0;
  int without_points = 0;  // Instances whose mask has too few points with depth.
  int suppressed = 0;      // Duplicates of other instances, and instances beyond the limit.
};

// Immutable; safe to use from many threads.
class Observer {
 public:
  // `occupancy` may be null. Otherwise it is in the frame of the poses, and the pose of each frame
  // is refined, within its covariance, by matching its walls to the occupied cells.
  Observer(std::unique_ptr<Segmenter> segmenter, const std::shared_ptr<const GridLayer>& occupancy,
           const ObserverOptions& options);
  ~Observer();

  // Returns the observation of `frame`, relative to its view. What it says of the view depends on
  // the frame's pose by the floor alone, if that is not seen in the image (ground_plane.h). Returns
  // INVALID_ARGUMENT from Validate(frame) if the frame is invalid, or from Validate(observation) if
  // the server would refuse the observation. `report` may be null. CANCELLED if the work of this
  // thread is cancelled.
  absl::StatusOr<Observation> Observe(const Frame& frame, FrameReport* report) const;

  // Estimates the most memory that Observe takes for each pixel of the image, besides the frame.
  int bytes_per_pixel() const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_OBSERVER_H_
