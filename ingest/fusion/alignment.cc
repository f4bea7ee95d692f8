#include "ingest/fusion/alignment.h"

#include <array>
#include <cmath>

namespace hypermap::fusion {
namespace {

double OccupancyAt(const ShapeGrid& shape, const Point& p, double doubt) {
  // Bilinear between the cells' centres, so that the search feels parts of a cell.
  const double x = p.x / shape.resolution_m() - 0.5;
  const double y = p.y / shape.resolution_m() - 0.5;
  const auto col = static_cast<int32_t>(std::floor(x));
  const auto row = static_cast<int32_t>(std::floor(y));
  const double fx = x - col;
  const double fy = y - row;
  return (1 - fy) * ((1 - fx) * shape.Occupancy({row, col}, doubt) +
                     fx * shape.Occupancy({row, col + 1}, doubt)) +
         fy * ((1 - fx) * shape.Occupancy({row + 1, col}, doubt) +
               fx * shape.Occupancy({row + 1, col + 1}, doubt));
}

}  // namespace

Point Apply(const Eigen::Vector3d& motion, const Point& pivot, const Point& p) {
  const double c = std::cos(motion.z());
  const double s = std::sin(motion.z());
  const double dx = p.x - pivot.x;
  const double dy = p.y - pivot.y;
  return {pivot.x + c * dx - s * dy + motion.x(), pivot.y + s * dx + c * dy + motion.y()};
}

Eigen::Vector3d Align(const std::vector<AlignmentPair>& pairs, const Point& pivot,
                      const Eigen::Matrix3d& prior, const EvidenceParameters& parameters) {
  const Eigen::Matrix3d information = prior.inverse();
  const auto value = [&](const Eigen::Vector3d& motion) {
    double sum = -0.5 * motion.dot(information * motion);
    for (const AlignmentPair& pair : pairs) {
      double occupancy = 0.0;
      for (const Point& cell : pair.cells) {
        occupancy +=
            OccupancyAt(pair.track->shape, Apply(motion, pivot, cell), parameters.shape_doubt);
      }
      sum +=
          parameters.align_gain * pair.weight * occupancy / static_cast<double>(pair.cells.size());
    }
    return sum;
  };
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double best_value = value(best);
  for (double step = 0.04; step > 0.004; step *= 0.5) {
    for (int round = 0; round < 6; ++round) {
      bool better = false;
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {1.0, -1.0}) {
          Eigen::Vector3d next = best;
          next[axis] += sign * (axis == 2 ? 0.25 * step : step);
          const double next_value = value(next);
          if (next_value <= best_value) continue;
          best = next;
          best_value = next_value;
          better = true;
        }
      }
      if (!better) break;
    }
  }
  return best;
}

}  // namespace hypermap::fusion
