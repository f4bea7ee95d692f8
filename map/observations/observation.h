// Observations: what a robot saw in one frame, on the plane of the map. They are the input of
// fusion.
#ifndef HYPERMAP_MAP_OBSERVATIONS_OBSERVATION_H_
#define HYPERMAP_MAP_OBSERVATIONS_OBSERVATION_H_

#include <Eigen/Geometry>
#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "map/objects/semantic_object.h"

namespace hypermap {

// The cells col_begin <= col < col_end of a row.
struct CellSpan {
  int32_t row = 0;
  int32_t col_begin = 0;
  int32_t col_end = 0;

  friend bool operator==(const CellSpan&, const CellSpan&) = default;
};

// A set of square cells. The lower left corner of cell (0, 0) is at `frame_from_cells`; rows count
// along its y axis, columns along its x axis. Spans are sorted and do not overlap.
struct CellPatch {
  PlanarTransform frame_from_cells;
  double resolution_m = 0.01;
  std::vector<CellSpan> spans;

  friend bool operator==(const CellPatch&, const CellPatch&) = default;
};

// An instance that the detector found, as points on the map.
struct Detection {
  // Scores of the classes, in (0, 1]; at least one.
  std::map<std::string, double> scores;
  // Convex hull of the points, on the plane.
  Polygon hull;
  // The cells of the plane that contain points.
  CellPatch cells;
  // Range of the points' heights above the plane.
  HeightRange height;
  int32_t num_points = 0;
  // Mean distance of the points from the camera, metres.
  double range_m = 0.0;
  // Share of the mask's border that is at the border of the image or next to something nearer, in
  // [0, 1]: an indication of how much of the thing is not visible.
  double truncation = 0.0;
  // Weight of the detection as evidence of position and shape, in (0, 1]. It depends on range
  // (map/observations/range_weight.h) and truncation (ingest/perception/weight.h), but not on the
  // scores.
  double weight = 1.0;

  friend bool operator==(const Detection&, const Detection&) = default;
};

// The depth image of the frame, thinned to every n-th pixel. It distinguishes empty places from
// hidden ones at any height. Row-major, top row first. Pixel (u, v) looks along ((u - cx) / fx, (v
// - cy) / fy, 1) in the camera's optical frame (x right, y down, z forward).
struct DepthView {
  // Value of `owner` for pixels in the masks of several detections.
  static constexpr uint8_t kSeveral = 255;

  int32_t columns = 0;
  int32_t rows = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  // Depth along the optical axis in millimetres; 0: no return.
  std::vector<uint16_t> depth_mm;
  // The detection whose mask contains the pixel: 0 for none, i + 1 for detections[i], kSeveral for
  // more than one.
  std::vector<uint8_t> owner;

  friend bool operator==(const DepthView&, const DepthView&) = default;
};

// The pose of the camera. The third axis of the frame points up from the plane.
struct SensorPose {
  Eigen::Isometry3d frame_from_camera = Eigen::Isometry3d::Identity();  // From the optical frame.
  // Covariance of (x, y, yaw), in m and rad. Zero: exact. Of the pose in `frame_id`, also in an
  // observation that is relative to its view.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// A pose on the plane as a localisation claims it: the origin below the camera, the x axis along
// its optical axis (ViewPose).
struct PoseClaim {
  PlanarTransform frame_from_view;
  // Covariance of (x, y, yaw), in m and rad. Zero: exact.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// Maximal number of detections in an observation, as DepthView::owner is one byte.
inline constexpr size_t kMaxDetections = 254;

struct Observation {
  // The robot, and a number that it gives to no other frame of the layer. Together they identify
  // the observation, which counts once, however often it is sent.
  std::string robot;
  int64_t sequence = 0;
  // The time of the frame, by the robot's clock.
  absl::Time stamp;
  // The frame of all coordinates; empty: the map's own.
  std::string frame_id;
  // If set, the observation is relative to its view: `pose`, polygons and the origins of cells are
  // in the frame of the view (map/observations/view_frame.h), whose pose in `frame_id` this is.
  // What was seen then does not depend on where the robot took itself to be. Placed() gives the
  // other form, which fusion takes.
  std::optional<PlanarTransform> frame_from_view;
  SensorPose pose;
  // The claim from which `pose` was found by matching the frame to a map; nullopt if `pose` is the
  // claim itself.
  std::optional<PoseClaim> claim;
  // Convex hull of everything that was seen, on the plane (Zaenker et al. 2020, section IV-B). May
  // be empty.
  Polygon view_hull;
  // Area on the plane that was seen to be free of obstacles, by bearing; becomes explored floor.
  // May be empty.
  Polygon free_space;
  std::optional<DepthView> depth;
  std::vector<Detection> detections;
};

// Order of the observations of a layer: by stamp, then robot, then sequence.
struct ObservationKey {
  absl::Time stamp;
  std::string robot;
  int64_t sequence = 0;

  friend std::strong_ordering operator<=>(const ObservationKey&, const ObservationKey&) = default;
};
ObservationKey KeyOf(const Observation& observation);

// Returns INVALID_ARGUMENT unless it has 1 to 256 bytes without control characters.
absl::Status ValidateRobotName(absl::string_view robot);

// Returns INVALID_ARGUMENT naming the field that is wrong ("detections[3].weight: ..."). Does not
// check polygons, which are valid by construction, but that those of an observation that is
// relative to its view can be stored where the view is.
absl::Status Validate(const Observation& observation);

// Returns the observation with all coordinates in `frame_id`: as it is, unless it is relative to
// its view.
Observation Placed(const Observation& observation);

// Returns whether nothing of the observation, which must not be relative to its view, is more than
// kMaxCoordinate_m from the origin along an axis, or so small there that rounding turns it over.
bool CanBeStored(const Observation& observation);

// Returns the observation in another frame.
Observation Transformed(const Observation& observation, const PlanarTransform& target_from_source,
                        const std::string& target_frame_id);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_OBSERVATION_H_
