// A made-up room with boxes in it, and the depth that a camera sees there, without noise.
#ifndef HYPERMAP_MAP_SMOOTHING_TESTING_RENDERED_ROOM_H_
#define HYPERMAP_MAP_SMOOTHING_TESTING_RENDERED_ROOM_H_

#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "map/frames/planar_transform.h"
#include "map/layers/grid_layer.h"
#include "map/observations/observation.h"

namespace hypermap::smoothing {

struct RoomBox {
  Box footprint;
  double height_m = 1.0;
};

// The walls are the sides of the first box, seen from within; the others stand on its floor.
using Room = std::vector<RoomBox>;

// A room of 8 m x 6 m with furniture and pillars.
Room FurnishedRoom();

// The depth that a level camera sees from a pose, 1.1 m above the floor, in the observation of
// `robot` with this number, which also tells its time, five a second. The pose of the observation
// is `claimed`, with `sigma` as the standard deviations of x, y (m) and yaw (rad).
Observation SeenFrom(const Room& room, const PlanarTransform& pose, const PlanarTransform& claimed,
                     const Eigen::Vector3d& sigma, const std::string& robot, int64_t number);

// A drive of `frames` poses through the room, in a circle.
std::vector<PlanarTransform> CircularDrive(int frames, double first_yaw = 0.0);

// Errors of a localisation: a bias that changes slowly, and jitter.
class LocalisationErrors {
 public:
  explicit LocalisationErrors(uint32_t seed) : random_(seed) {}
  // The claim for the next pose, a fifth of a second after the one before.
  PlanarTransform Claim(const PlanarTransform& pose);
  static Eigen::Vector3d Sigma() { return {0.06, 0.06, 0.015}; }

 private:
  std::mt19937 random_;
  Eigen::Vector3d bias_ = Eigen::Vector3d::Zero();
  bool has_bias_ = false;
};

// An occupancy grid of the room, with the cells occupied in which a laser ends: cells of 5 cm.
std::shared_ptr<const GridLayer> GridOf(const Room& room);

}  // namespace hypermap::smoothing

#endif  // HYPERMAP_MAP_SMOOTHING_TESTING_RENDERED_ROOM_H_
