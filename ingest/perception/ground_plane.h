// The floor as the camera sees it: how the camera is tilted, and how high it is.
//
// Trajectories tell this, too, but a localisation takes a robot's body for stiff, and one
// trajectory differs from another. What is measured in the depth image depends on the image alone,
// so that a frame gives the same view (map/observations/view_frame.h) whichever trajectory its pose
// is from.
#ifndef HYPERMAP_INGEST_PERCEPTION_GROUND_PLANE_H_
#define HYPERMAP_INGEST_PERCEPTION_GROUND_PLANE_H_

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "ingest/perception/frame.h"

namespace hypermap::ingest {

struct GroundPlane {
  // Unit vector that points up from the plane, in the optical frame (x right, y down, z forward).
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();
  // Height of the camera above the plane, metres.
  double height_m = 0.0;
};

// Returns the plane z = 0 of a pose's frame.
GroundPlane ClaimedGround(const Eigen::Isometry3d& frame_from_camera);

// Returns the plane of the floor in the image, if it is seen well enough, and is within 2 degrees
// and 5 cm of the claimed one. It is rounded to 2^-14 rad and m, which makes it the same, to the
// last bit, for all claims from which the search arrives at it: those within about a degree and
// 2 cm. `rays` are the PixelRays() of the camera.
//
// The inverse depth of a plane is linear in the coordinates of a pixel's ray, and its noise hardly
// depends on range, so that the plane is found by least squares on inverse depths, reweighted by
// Tukey's biweight.
std::optional<GroundPlane> MeasuredGround(const DepthImage& depth,
                                          const std::vector<Eigen::Vector2f>& rays,
                                          const GroundPlane& claimed);

// Returns the plane from which heights are counted: the measured one; without it the claimed one,
// rounded to degrees and centimetres, which is the same for most claims that differ by their noise.
// The claimed one as it is if the optical axis is more than 60 degrees from the horizon, because
// the direction of the view would then change much more than the tilt.
GroundPlane GroundOf(const DepthImage& depth, const std::vector<Eigen::Vector2f>& rays,
                     const GroundPlane& claimed);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_PERCEPTION_GROUND_PLANE_H_
