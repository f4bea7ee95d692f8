#include "simulation/worlds/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "map/frames/planar_transform.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "map/geometry/predicates.h"
#include "simulation/worlds/furniture.h"
#include "simulation/worlds/random.h"

namespace hypermap::simulation {
namespace {

constexpr double kWallHeight = 2.5;
constexpr double kWallThickness = 0.1;
// Smallest distances of furniture to the path, to walls, to other furniture, to the parts of a
// table that it is pushed under, and between things on a table, metres.
constexpr double kPathClearance = 0.55;
constexpr double kWallClearance = 0.06;
constexpr double kGap = 0.12;
constexpr double kTuckedGap = 0.02;
constexpr double kTopGap = 0.04;
// Random places that are tried before a piece is left out.
constexpr int kTrials = 400;

const Box kRooms[] = {{{0.0, 0.0}, {6.2, 5.4}}, {{6.3, 0.0}, {11.6, 5.4}}};

// Returns the footprint grown by `by_m` on all sides: intersecting it is cheaper than computing
// distances between footprints.
Polygon Grown(const Polygon& footprint, double by_m) {
  std::vector<Point> points;
  for (const Point& p : footprint.outer()) {
    for (const double dx : {-by_m, by_m}) {
      for (const double dy : {-by_m, by_m}) points.push_back({p.x + dx, p.y + dy});
    }
  }
  return ConvexHull(std::move(points));
}

double DistanceToPath(const Polygon& footprint, const Ring& path) {
  constexpr double kStep = 0.05;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i + 1 < path.size(); ++i) {
    const double length = std::hypot(path[i + 1].x - path[i].x, path[i + 1].y - path[i].y);
    for (double s = 0.0; s <= length; s += kStep) {
      const double t = s / length;
      nearest =
          std::min(nearest, Distance(footprint, {path[i].x + t * (path[i + 1].x - path[i].x),
                                                 path[i].y + t * (path[i + 1].y - path[i].y)}));
    }
  }
  return nearest;
}

void AddWall(Scene& scene, const Box& box) {
  scene.structure.push_back({Polygon::FromBox(box).outer(), 0.0, kWallHeight});
}

// Adds the floor and walls of the two rooms, with a door in the wall between them, and the path.
void AddStructure(Scene& scene) {
  const Box &left = kRooms[0], &right = kRooms[1];
  const double t = kWallThickness, x0 = left.min.x, x1 = right.max.x, y0 = left.min.y,
               y1 = left.max.y;
  scene.bounds = {{x0 - t, y0 - t}, {x1 + t, y1 + t}};
  scene.structure.push_back({Polygon::FromBox(scene.bounds).outer(), -0.1, 0.0});
  AddWall(scene, {{x0 - t, y0 - t}, {x1 + t, y0}});
  AddWall(scene, {{x0 - t, y1}, {x1 + t, y1 + t}});
  AddWall(scene, {{x0 - t, y0}, {x0, y1}});
  AddWall(scene, {{x1, y0}, {x1 + t, y1}});
  AddWall(scene, {{left.max.x, y0}, {right.min.x, 2.1}});
  AddWall(scene, {{left.max.x, 3.3}, {right.min.x, y1}});
  scene.path = {{1.4, 2.7}, {2.6, 2.2}, {4.2, 3.1}, {5.6, 2.7},
                {6.9, 2.7}, {8.2, 2.1}, {9.4, 3.2}, {10.2, 2.7}};
}

// Places furniture at random where there is room. The methods return false if there is none.
class Furnisher {
 public:
  Furnisher(Scene& scene, Random& random) : scene_(scene), random_(random) {}

  // Places the body on the floor of a room, about parallel to the walls.
  bool PlaceOnFloor(const Body& body, const Box& room) {
    for (int i = 0; i < kTrials; ++i) {
      const PlanarTransform pose(random_.Uniform(room.min.x, room.max.x),
                                 random_.Uniform(room.min.y, room.max.y), RandomTurn());
      if (TryOnFloor(body, pose, room, /*tucked=*/false)) return true;
    }
    return false;
  }

  // Places the body at a table of depth `depth_m`, facing it, pushed under it or drawn back.
  bool PlaceAt(const Body& body, const PlanarTransform& world_from_table, double depth_m,
               const Box& room) {
    for (int i = 0; i < kTrials / 10; ++i) {
      const bool behind = random_.Chance(0.5);
      const double off_m = depth_m / 2 + random_.Uniform(-0.10, 0.42);
      const PlanarTransform seat(random_.Uniform(-0.4, 0.4), behind ? off_m : -off_m,
                                 (behind ? 0.0 : std::numbers::pi) + random_.Uniform(-0.3, 0.3));
      if (TryOnFloor(body, world_from_table * seat, room, /*tucked=*/true)) return true;
    }
    return false;
  }

  // Places the body on top of a table.
  bool PlaceOnTop(const Body& body, const Top& top, const PlanarTransform& world_from_table) {
    for (int i = 0; i < kTrials; ++i) {
      const PlanarTransform pose(random_.Uniform(top.area.min.x, top.area.max.x),
                                 random_.Uniform(top.area.min.y, top.area.max.y),
                                 random_.Uniform(-0.7, 0.7));
      const Polygon there = FootprintOf(Placed(body, pose, 0.0));
      const Box& box = there.bounds();
      if (!top.area.Covers(box.min) || !top.area.Covers(box.max)) continue;
      Body placed = Placed(body, world_from_table * pose, top.height_m);
      if (!IsFree(FootprintOf(placed), kTopGap, on_tops_)) continue;
      on_tops_.push_back(FootprintOf(placed));
      scene_.bodies.push_back(std::move(placed));
      return true;
    }
    return false;
  }

  const PlanarTransform& last_pose() const { return last_pose_; }

 private:
  double RandomTurn() {
    return random_.Below(4) * std::numbers::pi / 2 + random_.Uniform(-0.12, 0.12);
  }

  static bool IsFree(const Polygon& footprint, double gap_m, const std::vector<Polygon>& taken) {
    const Polygon grown = Grown(footprint, gap_m);
    return std::none_of(taken.begin(), taken.end(), [&grown](const Polygon& other) {
      return IntersectionArea(grown, other) > 0.0;
    });
  }

  // Returns whether the body touches no other body on the floor. Unlike with IsFree, footprints may
  // overlap if heights do not, so that a chair's seat fits under a table.
  bool Fits(const Body& body) const {
    for (const Prism& part : body.parts) {
      const Polygon grown = Grown(Polygon::MakeUnchecked({part.footprint}), kTuckedGap);
      for (const Prism& other : floor_parts_) {
        if (part.low_m >= other.high_m || other.low_m >= part.high_m) continue;
        if (IntersectionArea(grown, Polygon::MakeUnchecked({other.footprint})) > 0.0) return false;
      }
    }
    return true;
  }

  bool TryOnFloor(const Body& body, const PlanarTransform& pose, const Box& room, bool tucked) {
    Body placed = Placed(body, pose, 0.0);
    const Polygon footprint = FootprintOf(placed);
    const Polygon with_air = Grown(footprint, kWallClearance);
    if (!room.Covers(with_air.bounds().min) || !room.Covers(with_air.bounds().max)) return false;
    if (DistanceToPath(footprint, scene_.path) < kPathClearance) return false;
    if (!(tucked ? Fits(placed) : IsFree(footprint, kGap, on_floor_))) return false;
    on_floor_.push_back(footprint);
    floor_parts_.insert(floor_parts_.end(), placed.parts.begin(), placed.parts.end());
    scene_.bodies.push_back(std::move(placed));
    last_pose_ = pose;
    return true;
  }

  Scene& scene_;
  Random& random_;
  std::vector<Polygon> on_floor_;
  std::vector<Prism> floor_parts_;
  std::vector<Polygon> on_tops_;
  PlanarTransform last_pose_;
};

// Adds a table with things on it and one or two chairs.
void AddTable(Furnisher& furnisher, Random& random, const Body& table, double depth_m,
              const Box& room) {
  if (!furnisher.PlaceOnFloor(table, room)) return;
  const PlanarTransform world_from_table = furnisher.last_pose();
  const Top top = TopOf(table);
  const Body large[] = {Laptop(), Screen()};
  const Body small[] = {Cup(), Cup(), Bottle(), Book()};
  furnisher.PlaceOnTop(large[random.Below(2)], top, world_from_table);
  for (int i = 1 + random.Below(3); i > 0; --i) {
    furnisher.PlaceOnTop(small[random.Below(4)], top, world_from_table);
  }
  for (int i = 1 + random.Below(2); i > 0; --i) {
    furnisher.PlaceAt(Chair(), world_from_table, depth_m, room);
  }
}

}  // namespace

Polygon FootprintOf(const Body& body) {
  std::vector<Point> points;
  for (const Prism& part : body.parts) {
    points.insert(points.end(), part.footprint.begin(), part.footprint.end());
  }
  return ConvexHull(std::move(points));
}

HeightRange HeightOf(const Body& body) {
  HeightRange height{body.parts.front().low_m, body.parts.front().high_m};
  for (const Prism& part : body.parts) {
    height.low_m = std::min(height.low_m, part.low_m);
    height.high_m = std::max(height.high_m, part.high_m);
  }
  return height;
}

Scene MakeOffice(uint64_t seed) {
  Scene scene;
  Random random(seed);
  AddStructure(scene);
  Furnisher furnisher(scene, random);
  for (const Box& room : kRooms) {
    furnisher.PlaceOnFloor(Couch(), room);
    AddTable(furnisher, random, DiningTable(), 0.9, room);
    AddTable(furnisher, random, Desk(), 0.7, room);
    for (const Body& body : {Suitcase(), PottedPlant(), Chair()}) {
      if (random.Chance(0.8)) furnisher.PlaceOnFloor(body, room);
    }
  }
  return scene;
}

}  // namespace hypermap::simulation
