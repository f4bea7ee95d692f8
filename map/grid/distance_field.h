// Distances to the nearest of some cells of a grid.
#ifndef HYPERMAP_MAP_GRID_DISTANCE_FIELD_H_
#define HYPERMAP_MAP_GRID_DISTANCE_FIELD_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "map/grid/grid_geometry.h"

namespace hypermap {

// The distance from any place to the centre of the nearest marked cell, at most the reach.
// Interpolated bilinearly between the centres of cells, since Gauss-Newton needs a continuous
// distance. Takes 4 bytes for each cell of the box. Immutable; safe to use from many threads.
class DistanceField {
 public:
  // Marks the cells of `box` for which `is_marked` holds. Linear in the cells of the box widened by
  // the reach. If the work of this thread is cancelled, the distances have no meaning.
  DistanceField(const GridGeometry& geometry, const CellBox& box,
                absl::FunctionRef<bool(const CellIndex&)> is_marked, double reach_m);

  // The distance in metres and its gradient along the axes of the layer's frame.
  struct Sample {
    double distance_m = 0.0;
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };
  // Returns the reach, without a gradient, far outside the box. `position` is in the layer's frame.
  Sample At(const Eigen::Vector2d& position) const;
  // Returns the distance alone.
  double DistanceAt(const Eigen::Vector2d& position) const;

  double reach_m() const { return reach_m_; }
  // Returns whether the box is empty: all distances are the reach.
  bool empty() const { return distance_m_.empty(); }

 private:
  // The four cells around a position, and the position between their centres.
  struct Corners {
    double d00, d01, d10, d11;
    double fx, fy;
  };
  // Returns false, and leaves `corners` alone, outside the box.
  bool CornersAt(const Eigen::Vector2d& position, Corners* corners) const;

  GridGeometry geometry_;
  CellBox box_;  // Widened by the reach.
  double reach_m_;
  double cos_yaw_;
  double sin_yaw_;
  std::vector<float> distance_m_;  // Row-major over box_.
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_GRID_DISTANCE_FIELD_H_
