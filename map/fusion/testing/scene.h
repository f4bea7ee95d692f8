// A made-up world of boxes on a floor, and a camera that sees it without noise: observations whose
// outcome is known.
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
  double pitch_rad = 0.3;  // down
};

// What the detector makes of the scene.
struct SceneDetector {
  // Of boxes by index: left out, or seen as another class.
  std::vector<int> missed;
  std::map<int, std::string> called;
  double score = 0.8;
  // The pose that the robot claims is off by this.
  double pose_error_x = 0.0;
  double pose_error_y = 0.0;
};

// `sequence` is also the time: five a second. A detection's hull and cells are those of the part of
// the box's footprint below its visible surface points.
Observation Observe(const std::vector<SceneBox>& scene, const SceneCamera& camera, int64_t sequence,
                    const SceneDetector& detector = {}, const std::string& robot = "r");

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_TESTING_SCENE_H_
