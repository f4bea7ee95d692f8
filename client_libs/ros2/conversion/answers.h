// The services of the original Hypermap (https://github.com/Eruvae/hypermap_msgs), answered from a
// snapshot.
//
// A layer that is asked for ints or strings tells of a cell what the map topics show of it:
//
//   occupancy     int -1, 0, 100 (and 1 to 99 in scale mode); "Free", "Occupied" or "Unknown"
//   exploration   int -1, 0, 100; "Explored", "Unexplored" or "Unknown"
//   scalar        the value rounded to an int, INT32_MIN if unknown; the value as text or "Unknown"
//   semantic      the least id of an object, 0 if there is none; labels, joined by "|"
//
// Locations are the centres of cells, and the centroids of objects. Points and areas are in the
// frame of their headers, an empty one being the map's own, and so are the locations. An area
// without points means the whole layer in a search, and nothing elsewhere.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_ANSWERS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_ANSWERS_H_

#include <string>

#include "absl/status/statusor.h"
#include "client_libs/ros2/conversion/grids.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/snapshot.h"

namespace hypermap::ros2 {

// NOT_FOUND for a layer or frame that the map does not have, FAILED_PRECONDITION for a frame that
// is not connected to the layer's, INVALID_ARGUMENT for an area that is no polygon,
// RESOURCE_EXHAUSTED for an answer of more than `max_items` locations.
class Answers {
 public:
  Answers(SnapshotPtr snapshot, GridMode mode, int64_t max_items)
      : snapshot_(std::move(snapshot)), mode_(mode), max_items_(max_items) {}

  absl::StatusOr<hypermap_msgs::GetIntAtPoint::Response> Answer(
      const hypermap_msgs::GetIntAtPoint::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetStringAtPoint::Response> Answer(
      const hypermap_msgs::GetStringAtPoint::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetIntsByArea::Response> Answer(
      const hypermap_msgs::GetIntsByArea::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetStringsByArea::Response> Answer(
      const hypermap_msgs::GetStringsByArea::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetLocationsByInt::Response> Answer(
      const hypermap_msgs::GetLocationsByInt::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetLocationsByString::Response> Answer(
      const hypermap_msgs::GetLocationsByString::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetSemanticByArea::Response> Answer(
      const hypermap_msgs::GetSemanticByArea::Request& request) const;
  absl::StatusOr<hypermap_msgs::GetSemanticByString::Response> Answer(
      const hypermap_msgs::GetSemanticByString::Request& request) const;

 private:
  const SnapshotPtr snapshot_;
  const GridMode mode_;
  const int64_t max_items_;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_ANSWERS_H_
