#include "client_libs/bench/imagined_site.h"

#include <cmath>
#include <iterator>
#include <utility>

#include "map/observations/range_weight.h"

namespace hypermap::bench {
namespace {

constexpr double kSpacing_m = 3.0;
constexpr double kEyeHeight_m = 1.2;
constexpr double kError_m = 0.02;  // standard deviation of what a robot measures
constexpr double kCell_m = 0.05;
constexpr const char* kLabels[] = {"chair", "table", "shelf", "pallet", "plant"};

double Uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

// The pose of a camera at (x, y) that looks horizontally along `yaw`.
Eigen::Isometry3d CameraPose(double x, double y, double yaw) {
  const Eigen::Vector3d forward(std::cos(yaw), std::sin(yaw), 0.0);
  const Eigen::Vector3d right(std::sin(yaw), -std::cos(yaw), 0.0);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = Eigen::Vector3d(x, y, kEyeHeight_m);
  return pose;
}

// All cells of the box, whose corner is that of the first cell.
CellPatch CellsOf(const Box& box) {
  CellPatch patch;
  patch.frame_from_cells = PlanarTransform(box.min.x, box.min.y, 0.0);
  patch.resolution_m = kCell_m;
  const auto rows = static_cast<int32_t>(std::ceil((box.max.y - box.min.y) / kCell_m));
  const auto columns = static_cast<int32_t>(std::ceil((box.max.x - box.min.x) / kCell_m));
  for (int32_t row = 0; row < rows; ++row) patch.spans.push_back({row, 0, columns});
  return patch;
}

// REQUIRES: the box has an area.
Detection DetectionOf(const Box& box, double height_m, const std::string& label, double range_m,
                      double score) {
  Detection detection;
  detection.scores[label] = score;
  detection.hull = Polygon::FromBox(box);
  detection.cells = CellsOf(box);
  detection.height = {0.0, height_m};
  detection.num_points = 200;
  detection.range_m = range_m;
  detection.weight = RangeWeight(range_m);
  return detection;
}

}  // namespace

ImaginedSite::ImaginedSite(uint64_t seed, int num_things)
    : lattice_side_(static_cast<int>(std::ceil(std::sqrt(num_things)))) {
  Random random = RandomOf(seed, RandomRole::kSite, 0);
  for (int i = 0; i < num_things; ++i) {
    const int column = i % lattice_side_;
    const int row = i / lattice_side_;
    const double x = kSpacing_m * (column + 0.5);
    const double y = kSpacing_m * (row + 0.5);
    const double width = Uniform(random, 0.4, 0.8);
    const double depth = Uniform(random, 0.4, 0.8);
    things_.push_back({Box{{x, y}, {x + width, y + depth}}, Uniform(random, 0.4, 1.6),
                       kLabels[random() % std::size(kLabels)]});
  }
}

double ImaginedSite::side_m() const { return kSpacing_m * lattice_side_; }

Observation ImaginedSite::Observe(const std::string& robot, int64_t sequence, absl::Time stamp,
                                  Random& random) const {
  const int first = static_cast<int>(random() % things_.size());
  const Thing& ahead = things_[first];
  const double yaw = Uniform(random, -M_PI, M_PI);
  const Point eye{ahead.box.min.x - 1.5 * std::cos(yaw), ahead.box.min.y - 1.5 * std::sin(yaw)};

  Observation observation;
  observation.robot = robot;
  observation.sequence = sequence;
  observation.stamp = stamp;
  observation.pose.frame_from_camera = CameraPose(eye.x, eye.y, yaw);
  observation.pose.covariance = Eigen::Vector3d(0.0025, 0.0025, 0.0003).asDiagonal();
  std::normal_distribution<double> error(0.0, kError_m);
  for (const int i : {first, first + 1, first + lattice_side_}) {
    if (i >= num_things()) continue;
    const Thing& thing = things_[i];
    const double dx = error(random);
    const double dy = error(random);
    const Box seen{{thing.box.min.x + dx, thing.box.min.y + dy},
                   {thing.box.max.x + dx, thing.box.max.y + dy}};
    observation.detections.push_back(DetectionOf(seen, thing.height_m, thing.label,
                                                 Distance(seen, eye), Uniform(random, 0.6, 0.95)));
  }
  return observation;
}

std::vector<Point> ImaginedSite::AskedPoints(int count, Random& random) const {
  const Point middle = RandomPlace(random);
  std::vector<Point> points;
  points.reserve(count);
  for (int i = 0; i < count; ++i) {
    points.push_back(
        {middle.x + Uniform(random, -3.0, 3.0), middle.y + Uniform(random, -3.0, 3.0)});
  }
  return points;
}

SemanticObject ImaginedSite::EditedObject(int64_t number, Random& random) const {
  const Point at = RandomPlace(random);
  SemanticObject object;
  switch (number % 3) {
    case 0:
      object.label = "zone";
      object.shape = Polygon::FromBox(Box{at, {at.x + 1.5, at.y + 1.0}});
      break;
    case 1:
      object.label = "lane";
      object.shape = *LineString::Make({at, {at.x + 2.0, at.y}, {at.x + 2.0, at.y + 1.0}});
      break;
    default:
      object.label = "marker";
      object.shape = Shape::MakePointUnchecked(at);
  }
  return object;
}

Point ImaginedSite::RandomPlace(Random& random) const {
  return {Uniform(random, 0.0, side_m()), Uniform(random, 0.0, side_m())};
}

}  // namespace hypermap::bench
