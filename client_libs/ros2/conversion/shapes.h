// Objects and frames as messages of ROS.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_SHAPES_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_SHAPES_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/frames/planar_transform.h"
#include "map/geometry/polygon.h"
#include "map/objects/semantic_object.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

// The vertices of a shape, moved by `transform`; of a polygon those of the outer ring, since the
// message has no holes.
geometry_msgs::Polygon ToPolygon(const Shape& shape, const PlanarTransform& transform);
// INVALID_ARGUMENT if the points are no ring of a valid polygon. Heights are ignored.
absl::StatusOr<Polygon> FromPolygon(const geometry_msgs::Polygon& polygon);

// The id, shape and label of an object, and its classes as tags with their scores as confidences.
// Ids are those of the map, modulo 2^32.
hypermap_msgs::SemanticObject ToSemanticObject(const SemanticObject& object,
                                               const PlanarTransform& transform);

// All objects of a layer in the map's own frame; none if the layer's frame is not connected to it.
hypermap_msgs::SemanticMap ToSemanticMap(const Snapshot& snapshot, const SemanticLayer& layer);

// A colour that depends on the class alone, the one that the dashboard gives it on a light page.
std_msgs::ColorRGBA ClassColour(const std::string& label);

// The objects of all semantic layers as outlines, lines and spheres with their labels, after a
// marker that deletes the ones before. Namespaces are the layers' names, frames the layers' own.
visualization_msgs::MarkerArray ToMarkers(const Snapshot& snapshot, absl::Time stamp);

// The transforms between the map's frames.
tf2_msgs::TFMessage ToTransforms(const FrameTree& frames, absl::Time stamp);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_SHAPES_H_
