// From a frame to the observation that is sent to the server.
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
  // Instances beyond this many in a frame are left out, the lowest scores first.
  int max_instances = 254;
  // Returns beyond this range take no part in footprints, metres.
  double max_range_m = 8.0;
};

// What was left out of an observation and why.
struct FrameReport {
  int instances = 0;
  int detections = 0;
  int without_points = 0;  // no or too few points with depth in the mask
  int suppressed = 0;      // of things that another instance stood for, or beyond the limit
};

// Immutable; safe to use from many threads.
class Observer {
 public:
  // `occupancy` may be null; when given (in the frame of the poses), the pose of each frame is
  // refined by matching its walls to the occupied cells, within the pose's covariance.
  Observer(std::unique_ptr<Segmenter> segmenter, std::shared_ptr<const GridLayer> occupancy,
           const ObserverOptions& options);
  ~Observer();

  // INVALID_ARGUMENT as Validate(frame), or as Validate(observation) of what would be returned.
  // `report` may be null.
  absl::StatusOr<Observation> Observe(const Frame& frame, FrameReport* report) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_OBSERVER_H_
