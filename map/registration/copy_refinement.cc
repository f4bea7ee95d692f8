#include "map/registration/copy_refinement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::registration {
namespace {

// One grid is a copy of the other, apart from what has changed, if this share of its walls lie in
// occupied cells of the other. Of grids from two drives, far fewer do.
constexpr double kLeastShareOfCopy = 0.75;
// Cells behind a wall in which its copy would be seen to lie if the pose were wrong.
constexpr double kBehindCells = 2.0;
constexpr size_t kMostWalls = 1500;
constexpr int kGenerations = 12;
constexpr size_t kSamples = 60;
constexpr size_t kElite = 10;
// The next generation is wider than the elite of the last one, so that it reaches beyond the best
// poses on all sides, and their mean is not drawn to where the search began.
constexpr double kWidening = 1.5;
// Standard deviation of the first generation at the walls, in cells of the coarser grid.
constexpr double kFirstSigmaCells = 0.4;

using Motion = Eigen::Vector3d;  // x, y, yaw of the source's centre.

// Counts walls of one grid in cells of another one.
struct Hits {
  int comparable = 0;
  int occupied = 0;

  void Add(const WallMap& map, const Eigen::Vector2d& place) {
    const Floor floor = map.FloorAt(place);
    // Behind a wall nothing is known, but what lies there has missed the wall.
    if (floor == Floor::kUnknown &&
        map.distance().DistanceAt(place) > kBehindCells * map.resolution_m()) {
      return;
    }
    ++comparable;
    if (floor == Floor::kOccupied) ++occupied;
  }
  double share() const { return comparable > 0 ? static_cast<double>(occupied) / comparable : 0.0; }
};

std::vector<Eigen::Vector2d> Some(const std::vector<Eigen::Vector2d>& walls) {
  const size_t number = std::min(walls.size(), kMostWalls);
  std::vector<Eigen::Vector2d> some(number);
  for (size_t i = 0; i < number; ++i) some[i] = walls[i * walls.size() / number];
  return some;
}

class CopyRefinement {
 public:
  CopyRefinement(const WallMap& source, const WallMap& target, const PlanarTransform& pose)
      : source_(source),
        target_(target),
        pose_(pose),
        source_walls_(Some(source.walls())),
        target_walls_(Some(target.walls())) {
    const Point centre = pose * Point{source.centre().x(), source.centre().y()};
    centre_ = {centre.x, centre.y};
  }

  absl::StatusOr<PlanarTransform> Run() const {
    const double cell_m = std::max(source_.resolution_m(), target_.resolution_m());
    Motion sigma(cell_m, cell_m, cell_m / std::max(cell_m, source_.spread_m()));
    sigma *= kFirstSigmaCells;
    Motion mean = Motion::Zero();
    std::mt19937_64 random(1);  // The same grids give the same pose.
    for (int generation = 0; generation < kGenerations; ++generation) {
      HYPERMAP_RETURN_IF_ERROR(CheckCancelled());
      std::vector<Sample> samples = {{mean, ValueAt(mean)}};
      while (samples.size() < kSamples) {
        const Motion motion = mean + sigma.cwiseProduct(Normal(random));
        samples.push_back({motion, ValueAt(motion)});
      }
      std::stable_sort(samples.begin(), samples.end(),
                       [](const Sample& a, const Sample& b) { return a.value > b.value; });
      KeepElite(&samples);
      Refit(samples, &mean, &sigma);
    }
    return IsBetter(mean, cell_m) ? PoseAt(mean) : pose_;
  }

 private:
  struct Sample {
    Motion motion;
    double value;
  };

  // Whether the pose after `motion` is that of a copy. It must not have wandered off: the first
  // pose is right to within a cell.
  bool IsBetter(const Motion& motion, double cell_m) const {
    const double lever_m = motion.z() * source_.spread_m();
    return std::hypot(motion.head<2>().norm(), lever_m) <= cell_m &&
           BestShare(motion) >= kLeastShareOfCopy && ValueAt(motion) >= ValueAt(Motion::Zero());
  }

  // Three numbers with the standard normal distribution, by Box and Muller: those of the standard
  // library differ from one to the other.
  static Motion Normal(std::mt19937_64& random) {
    Motion normal;
    for (int i = 0; i < 3; ++i) {
      const double u = (static_cast<double>(random() >> 11) + 0.5) * 0x1.0p-53;
      const double v = static_cast<double>(random() >> 11) * 0x1.0p-53;
      normal[i] = std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * M_PI * v);
    }
    return normal;
  }

  // Of sorted samples. Those that are as good as the last one stay, so that the mean is in the
  // middle of all best poses.
  static void KeepElite(std::vector<Sample>* samples) {
    const double least = (*samples)[kElite - 1].value;
    const auto end = std::find_if(samples->begin(), samples->end(),
                                  [&](const Sample& sample) { return sample.value < least; });
    samples->erase(end, samples->end());
  }

  static void Refit(const std::vector<Sample>& samples, Motion* mean, Motion* sigma) {
    const auto n = static_cast<double>(samples.size());
    *mean = Motion::Zero();
    for (const Sample& sample : samples) *mean += sample.motion / n;
    Motion variance = Motion::Zero();
    for (const Sample& sample : samples) {
      variance += (sample.motion - *mean).cwiseAbs2() / n;
    }
    *sigma = kWidening * variance.cwiseSqrt();
  }

  void Count(const Motion& motion, Hits* of_source, Hits* of_target) const {
    const Eigen::Vector2d centre = centre_ + motion.head<2>();
    const Eigen::Matrix2d turn = Eigen::Rotation2Dd(pose_.yaw() + motion.z()).toRotationMatrix();
    for (const Eigen::Vector2d& wall : source_walls_) {
      of_source->Add(target_, centre + turn * (wall - source_.centre()));
    }
    for (const Eigen::Vector2d& wall : target_walls_) {
      of_target->Add(source_, source_.centre() + turn.transpose() * (wall - centre));
    }
  }
  double ValueAt(const Motion& motion) const {
    Hits of_source, of_target;
    Count(motion, &of_source, &of_target);
    return of_source.share() + of_target.share();
  }
  double BestShare(const Motion& motion) const {
    Hits of_source, of_target;
    Count(motion, &of_source, &of_target);
    return std::max(of_source.share(), of_target.share());
  }
  PlanarTransform PoseAt(const Motion& motion) const {
    const double yaw = pose_.yaw() + motion.z();
    const Eigen::Vector2d origin =
        centre_ + motion.head<2>() - Eigen::Rotation2Dd(yaw) * source_.centre();
    return PlanarTransform(origin.x(), origin.y(), yaw);
  }

  const WallMap& source_;
  const WallMap& target_;
  const PlanarTransform& pose_;
  std::vector<Eigen::Vector2d> source_walls_;
  std::vector<Eigen::Vector2d> target_walls_;
  Eigen::Vector2d centre_;
};

}  // namespace

absl::StatusOr<PlanarTransform> RefinedAsCopy(const WallMap& source, const WallMap& target,
                                              const PlanarTransform& pose) {
  return CopyRefinement(source, target, pose).Run();
}

}  // namespace hypermap::registration
