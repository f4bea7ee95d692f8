#include "map/smoothing/testing/rendered_room.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "map/layers/layer_registry.h"

namespace hypermap::smoothing {
namespace {

constexpr double kCameraHeight_m = 1.1;
constexpr int kColumns = 80;
constexpr int kRows = 60;
constexpr double kFocal = 70.0;
constexpr double kWallHeight_m = 2.5;
const absl::Time kStart = absl::FromUnixSeconds(1'700'000'000);

// Where the ray origin + t * direction, t > 0, enters the box, or, from within, leaves it.
double MeetsSides(const Box& box, const Point& origin, const Point& direction, bool from_within) {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  for (const auto& [at, by, low, high] :
       {std::tuple(origin.x, direction.x, box.min.x, box.max.x),
        std::tuple(origin.y, direction.y, box.min.y, box.max.y)}) {
    const double a = (low - at) / by;
    const double b = (high - at) / by;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (from_within) return leave;
  return enter > 0.0 && enter < leave ? enter : std::numeric_limits<double>::infinity();
}

// The depth along the optical axis of a pixel of the level camera.
double DepthAt(const Room& room, const PlanarTransform& pose, int u, int v) {
  const double across = (u - 0.5 * (kColumns - 1)) / kFocal;
  const double down = (v - 0.5 * (kRows - 1)) / kFocal;
  const Point origin{pose.x(), pose.y()};
  const Point ahead = pose * Point{1.0, -across};
  const Point direction{ahead.x - origin.x, ahead.y - origin.y};
  double nearest = down > 0.0 ? kCameraHeight_m / down : std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < room.size(); ++i) {
    const double t = MeetsSides(room[i].footprint, origin, direction, i == 0);
    const double height = kCameraHeight_m - t * down;
    if (height >= 0.0 && height <= room[i].height_m) nearest = std::min(nearest, t);
  }
  return nearest;
}

Eigen::Isometry3d CameraAt(const PlanarTransform& pose) {
  Eigen::Matrix3d view_from_camera;
  view_from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Eigen::Isometry3d camera = Eigen::Isometry3d::Identity();
  camera.linear() =
      Eigen::AngleAxisd(pose.yaw(), Eigen::Vector3d::UnitZ()).toRotationMatrix() * view_from_camera;
  camera.translation() = Eigen::Vector3d(pose.x(), pose.y(), kCameraHeight_m);
  return camera;
}

}  // namespace

Room FurnishedRoom() {
  Room room = {{{{-4.0, -3.0}, {4.0, 3.0}}, kWallHeight_m},
               {{{-3.9, -1.0}, {-3.1, 1.2}}, 0.75},
               {{{2.6, 1.9}, {3.9, 2.9}}, 1.8},
               {{{2.9, -2.9}, {3.4, -2.1}}, 1.2},
               {{{-1.2, 2.3}, {0.4, 2.9}}, 0.9},
               {{{-0.5, -2.8}, {0.9, -2.2}}, 0.5},
               {{{-0.3, -0.2}, {0.25, 0.3}}, 0.8}};
  // Pillars along the walls.
  for (const double x : {-3.3, -2.1, 1.2, 2.0}) {
    room.push_back({{{x, -3.0}, {x + 0.3, -2.75}}, kWallHeight_m});
    room.push_back({{{x, 2.75}, {x + 0.3, 3.0}}, kWallHeight_m});
  }
  for (const double y : {-2.2, -0.8, 0.6}) {
    room.push_back({{{3.75, y}, {4.0, y + 0.3}}, kWallHeight_m});
    room.push_back({{{-4.0, y - 0.7}, {-3.75, y - 0.4}}, kWallHeight_m});
  }
  return room;
}

Observation SeenFrom(const Room& room, const PlanarTransform& pose, const PlanarTransform& claimed,
                     const Eigen::Vector3d& sigma, const std::string& robot, int64_t number) {
  Observation observation;
  observation.robot = robot;
  observation.sequence = number;
  observation.stamp = kStart + number * absl::Milliseconds(200);
  observation.pose = {CameraAt(claimed), sigma.cwiseAbs2().asDiagonal()};
  DepthView view{kColumns, kRows, kFocal, kFocal, 0.5 * (kColumns - 1), 0.5 * (kRows - 1), {}, {}};
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < kColumns; ++u) {
      view.depth_mm.push_back(
          static_cast<uint16_t>(std::lround(1000.0 * std::min(60.0, DepthAt(room, pose, u, v)))));
    }
  }
  view.owner.assign(view.depth_mm.size(), 0);
  observation.depth = std::move(view);
  return observation;
}

std::vector<PlanarTransform> CircularDrive(int frames, double first_yaw) {
  std::vector<PlanarTransform> poses;
  for (int i = 0; i < frames; ++i) {
    const double angle = first_yaw + 0.07 * i;
    poses.emplace_back(1.5 * std::cos(angle), 1.2 * std::sin(angle), angle + 0.4);
  }
  return poses;
}

PlanarTransform LocalisationErrors::Claim(const PlanarTransform& pose) {
  std::normal_distribution<double> normal;
  const auto draw = [&](double share) -> Eigen::Vector3d {
    return std::sqrt(share) *
           Sigma().cwiseProduct(Eigen::Vector3d(normal(random_), normal(random_), normal(random_)));
  };
  const double decay = has_bias_ ? std::exp(-0.2 / 5.0) : 0.0;
  bias_ = decay * bias_ + draw(0.95 * (1.0 - decay * decay));
  has_bias_ = true;
  const Eigen::Vector3d error = bias_ + draw(0.05);
  return {pose.x() + error.x(), pose.y() + error.y(), pose.yaw() + error.z()};
}

std::shared_ptr<const GridLayer> GridOf(const Room& room) {
  constexpr double kCell_m = 0.05;
  const LayerSpec spec{.name = "occupancy",
                       .kind = LayerKind::kOccupancy,
                       .frame_id = "map",
                       .grid = GridGeometry{PlanarTransform(0.013, -0.021, 0.0), kCell_m}};
  GridWriter writer(std::static_pointer_cast<const GridLayer>(MakeEmptyLayer(spec)));
  const auto cell_of = [&](double x, double y) {
    const Point p = spec.grid->layer_from_grid.ApplyInverse({x, y});
    return CellIndex{static_cast<int32_t>(std::floor(p.y / kCell_m)),
                     static_cast<int32_t>(std::floor(p.x / kCell_m))};
  };
  const auto mark = [&](double x, double y) {
    const CellIndex cell = cell_of(x, y);
    const CellBox one{cell.row, cell.row + 1, cell.col, cell.col + 1};
    if (!writer.Write(one, {std::optional<double>(1.0)}).ok()) std::abort();
  };
  for (const RoomBox& box : room) {
    const Box& b = box.footprint;
    for (double x = b.min.x; x < b.max.x; x += 0.01) {
      mark(x, b.min.y);
      mark(x, b.max.y);
    }
    for (double y = b.min.y; y < b.max.y; y += 0.01) {
      mark(b.min.x, y);
      mark(b.max.x, y);
    }
  }
  return std::move(writer).Finish().layer;
}

}  // namespace hypermap::smoothing
