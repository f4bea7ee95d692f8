#include "simulation/worlds/furniture.h"

#include <cmath>
#include <numbers>

namespace hypermap::simulation {
namespace {

Prism Block(double x0, double y0, double x1, double y1, double low_m, double high_m) {
  return {{{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, low_m, high_m};
}

// Returns an upright prism with eight sides around the origin.
Prism Drum(double radius_m, double low_m, double high_m) {
  Prism prism{{}, low_m, high_m};
  for (int i = 0; i < 8; ++i) {
    const double angle = (i + 0.5) * std::numbers::pi / 4.0;
    prism.footprint.push_back({radius_m * std::cos(angle), radius_m * std::sin(angle)});
  }
  return prism;
}

// Adds four legs in the corners of a width x depth rectangle around the origin.
void AddLegs(Body& body, double width_m, double depth_m, double height_m) {
  constexpr double kThick = 0.05;
  for (const double x : {-width_m / 2, width_m / 2 - kThick}) {
    for (const double y : {-depth_m / 2, depth_m / 2 - kThick}) {
      body.parts.push_back(Block(x, y, x + kThick, y + kThick, 0.0, height_m));
    }
  }
}

Body Table(double width_m, double depth_m, double height_m) {
  constexpr double kThick = 0.04;
  Body table{
      "diningtable",
      {Block(-width_m / 2, -depth_m / 2, width_m / 2, depth_m / 2, height_m - kThick, height_m)}};
  AddLegs(table, width_m, depth_m, height_m - kThick);
  return table;
}

}  // namespace

Body DiningTable() { return Table(1.6, 0.9, 0.74); }
Body Desk() { return Table(1.3, 0.7, 0.72); }

Body Chair() {
  Body chair{
      "chair",
      {Block(-0.22, -0.22, 0.22, 0.22, 0.42, 0.47), Block(-0.22, 0.18, 0.22, 0.22, 0.47, 0.90)}};
  AddLegs(chair, 0.44, 0.44, 0.42);
  return chair;
}

Body Couch() {
  return {"couch",
          {Block(-0.9, -0.42, 0.9, 0.42, 0.05, 0.42), Block(-0.9, 0.22, 0.9, 0.42, 0.42, 0.82),
           Block(-0.9, -0.42, -0.72, 0.22, 0.42, 0.60), Block(0.72, -0.42, 0.9, 0.22, 0.42, 0.60)}};
}

Body Suitcase() { return {"suitcase", {Block(-0.25, -0.15, 0.25, 0.15, 0.0, 0.55)}}; }

Body PottedPlant() {
  return {"pottedplant", {Drum(0.16, 0.0, 0.30), Drum(0.05, 0.30, 0.45), Drum(0.26, 0.45, 0.95)}};
}

Body Cup() { return {"cup", {Drum(0.04, 0.0, 0.10)}}; }
Body Bottle() { return {"bottle", {Drum(0.04, 0.0, 0.18), Drum(0.015, 0.18, 0.26)}}; }
Body Book() { return {"book", {Block(-0.11, -0.08, 0.11, 0.08, 0.0, 0.035)}}; }

Body Laptop() {
  return {"laptop",
          {Block(-0.17, -0.12, 0.17, 0.12, 0.0, 0.02), Block(-0.17, 0.10, 0.17, 0.12, 0.02, 0.24)}};
}

Body Screen() {
  return {"tvmonitor",
          {Block(-0.12, -0.10, 0.12, 0.10, 0.0, 0.02), Block(-0.03, 0.0, 0.03, 0.03, 0.02, 0.15),
           Block(-0.28, -0.02, 0.28, 0.02, 0.15, 0.50)}};
}

Body Placed(const Body& body, const PlanarTransform& world_from_body, double lift_m) {
  Body placed{body.label, {}};
  for (const Prism& part : body.parts) {
    Prism moved{{}, part.low_m + lift_m, part.high_m + lift_m};
    for (const Point& p : part.footprint) moved.footprint.push_back(world_from_body * p);
    placed.parts.push_back(std::move(moved));
  }
  return placed;
}

Top TopOf(const Body& table) {
  Top top{{}, table.parts.front().high_m};
  for (const Point& p : table.parts.front().footprint) top.area.Extend(p);
  return top;
}

}  // namespace hypermap::simulation
