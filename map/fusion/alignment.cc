#include "map/fusion/alignment.h"

#include <algorithm>
#include <cmath>

namespace hypermap::fusion {
namespace {

// Avoids 0 / 0 in cells without evidence, because parameters allow a doubt of 0.
constexpr double kMinDoubt = 1e-6;
// Steps of the search are halved from the first while they exceed the bound. The last is 5 mm, half
// of a fine cell; the bound lies between it and the next, so that rounding doesn't add a step.
constexpr double kFirstStep_m = 0.04;
constexpr double kStepBound_m = 0.004;
// Most steps of one size along each axis. Balances the cost against the reach of the search, which
// is 6 * (4 + 2 + 1 + 0.5) = 45 cm along an axis.
constexpr int kMaxRounds = 6;
// A rotation by a quarter of the step, in radians, moves points 4 m away by one step.
constexpr double kTurnPerStep_rad_per_m = 0.25;

// std::floor of a value within the range of int32, which takes less than that.
int64_t RoundedDown(double value) {
  const auto truncated = static_cast<int64_t>(value);
  return truncated - (value < static_cast<double>(truncated) ? 1 : 0);
}

// The occupancy of a shape's cells, computed once for many lookups.
class OccupancyField {
 public:
  OccupancyField(const ShapeGrid& shape, double doubt)
      : resolution_m_(shape.resolution_m()), box_(shape.box()) {
    const std::vector<float>& hits = shape.hits();
    const std::vector<float>& misses = shape.misses();
    const auto least = static_cast<float>(std::max(doubt, kMinDoubt));
    cells_.reserve(hits.size());
    for (size_t i = 0; i < hits.size(); ++i) {
      cells_.push_back(hits[i] / (hits[i] + misses[i] + least));
    }
  }

  // Interpolates between the cells' centres, so that a motion of less than a cell changes the
  // value.
  double At(const Point& p) const {
    const double x = p.x / resolution_m_ - 0.5;
    const double y = p.y / resolution_m_ - 0.5;
    // Bounds are whole numbers, so that it does not matter whether x and y are rounded down before.
    if (!(x >= box_.col_begin && y >= box_.row_begin && x < box_.col_end - 1.0 &&
          y < box_.row_end - 1.0)) {
      return 0.0;
    }
    const int64_t col = RoundedDown(x);
    const int64_t row = RoundedDown(y);
    const double fx = x - static_cast<double>(col);
    const double fy = y - static_cast<double>(row);
    const auto cols = static_cast<size_t>(box_.cols());
    const float* at = &cells_[static_cast<size_t>(row - box_.row_begin) * cols +
                              static_cast<size_t>(col - box_.col_begin)];
    return (1 - fy) * ((1 - fx) * at[0] + fx * at[1]) +
           fy * ((1 - fx) * at[cols] + fx * at[cols + 1]);
  }

 private:
  const double resolution_m_;
  const CellBox box_;
  std::vector<float> cells_;
};

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
  std::vector<OccupancyField> fields;
  fields.reserve(pairs.size());
  for (const AlignmentPair& pair : pairs) {
    fields.emplace_back(pair.track->shape, parameters.shape_doubt);
  }
  const auto value = [&](const Eigen::Vector3d& motion) {
    double sum = -0.5 * motion.dot(information * motion);
    const double c = std::cos(motion.z());
    const double s = std::sin(motion.z());
    for (size_t i = 0; i < pairs.size(); ++i) {
      double occupancy = 0.0;
      for (const Point& cell : pairs[i].cells) {
        const double dx = cell.x - pivot.x;
        const double dy = cell.y - pivot.y;
        occupancy += fields[i].At(
            {pivot.x + c * dx - s * dy + motion.x(), pivot.y + s * dx + c * dy + motion.y()});
      }
      sum += parameters.align_gain * pairs[i].weight * occupancy /
             static_cast<double>(pairs[i].cells.size());
    }
    return sum;
  };
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double best_value = value(best);
  for (double step = kFirstStep_m; step > kStepBound_m; step *= 0.5) {
    for (int round = 0; round < kMaxRounds; ++round) {
      bool better = false;
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {1.0, -1.0}) {
          Eigen::Vector3d next = best;
          next[axis] += sign * (axis == 2 ? kTurnPerStep_rad_per_m * step : step);
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
