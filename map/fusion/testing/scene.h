// A made-up world of boxes on a floor, and a camera that sees it without noise. Its observations
// have a known outcome.
#ifndef HYPERMAP_MAP_FUSION_TESTING_SCENE_H_
#define HYPERMAP_MAP_FUSION_TESTING_SCENE_H_

#include <map>
#include <string>
#include <vector>

#include "map/observations/observation.h"

namespace hypermap::fusion {

struct SceneBox {
  std::string label;
  Box footprint;
  HeightRange height;
};

struct SceneCamera {
  double x = 0.0;
  double y = 0.0;
  double height_m = 1.1;
  double yaw_rad = 0.0;
  double pitch_rad = 0.3;  // Downwards.
};

// Errors of the simulated detector and of the robot's localisation.
struct SceneDetector {
  // Boxes, by index, that are missed, and boxes that are detected as another class.
  std::vector<int> missed;
  std::map<int, std::string> called;
  double score = 0.8;
  // Error of the position that the robot reports, metres.
  double pose_error_x = 0.0;
  double pose_error_y = 0.0;
};

// Renders an observation. `sequence` also sets the stamp: five frames a second. The hull and cells
// of a detection are those of the visible surface points of its box, projected to the floor.
Observation Observe(const std::vector<SceneBox>& scene, const SceneCamera& camera, int64_t sequence,
                    const SceneDetector& detector = {}, const std::string& robot = "r");

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_TESTING_SCENE_H_
