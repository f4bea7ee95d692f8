// The frame of a view: what a camera sees, as seen from the camera. Its origin is the point of the
// plane below the camera. Its x axis is the horizontal part of the optical axis or, of a camera
// that looks straight up or down, of the direction of its image's upper edge. Its z axis points up.
#ifndef HYPERMAP_MAP_OBSERVATIONS_VIEW_FRAME_H_
#define HYPERMAP_MAP_OBSERVATIONS_VIEW_FRAME_H_

#include <Eigen/Geometry>

#include "map/frames/planar_transform.h"

namespace hypermap {

// Returns the pose of the view of a camera whose pose in space is given.
PlanarTransform ViewPose(const Eigen::Isometry3d& frame_from_camera);

// Likewise, rounded to 2^-30 m and rad, so that poses whose rotations were only written in another
// way, such as by another quaternion, have views that are equal.
PlanarTransform RoundedViewPose(const Eigen::Isometry3d& frame_from_camera);

// Returns the pose of a camera in the frame of its view. `up` is the unit vector that points up
// from the plane, in the optical frame (x right, y down, z forward).
//   frame_from_camera == ViewPose(frame_from_camera).InSpace() *
//                        ViewFromCamera(frame_from_camera.linear().row(2), height)
Eigen::Isometry3d ViewFromCamera(const Eigen::Vector3d& up, double height_m);

}  // namespace hypermap

#endif  // HYPERMAP_MAP_OBSERVATIONS_VIEW_FRAME_H_
