// Connected regions of equal numbers in an image.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_REGIONS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_REGIONS_H_

#include <cstdint>
#include <vector>

namespace hypermap::ros2 {

// The region of each pixel, row-major; regions are numbered from 0 in the order of their first
// pixels.
struct Regions {
  int count = 0;
  std::vector<int> of;
};

// The 8-connected regions of pixels with equal numbers. `numbers` has width * height elements,
// row-major. Two passes with a union of labels (Rosenfeld and Pfaltz 1966): almost linear in the
// number of pixels.
Regions RegionsOf(const std::vector<int32_t>& numbers, int width);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_REGIONS_H_
