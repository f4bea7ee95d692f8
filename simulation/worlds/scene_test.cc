#include "simulation/worlds/scene.h"

#include <set>

#include "gtest/gtest.h"
#include "map/geometry/convex_hull.h"
#include "map/geometry/overlap.h"
#include "map/geometry/predicates.h"

namespace hypermap::simulation {
namespace {

bool Collide(const Body& a, const Body& b) {
  for (const Prism& p : a.parts) {
    for (const Prism& q : b.parts) {
      if (p.low_m >= q.high_m || q.low_m >= p.high_m) continue;
      if (IntersectionArea(Polygon::MakeUnchecked({p.footprint}),
                           Polygon::MakeUnchecked({q.footprint})) > 0.0) {
        return true;
      }
    }
  }
  return false;
}

TEST(SceneTest, ASeedIsAPlace) {
  const Scene a = MakeOffice(7), b = MakeOffice(7), other = MakeOffice(8);
  ASSERT_EQ(a.bodies.size(), b.bodies.size());
  for (size_t i = 0; i < a.bodies.size(); ++i) {
    EXPECT_EQ(a.bodies[i].label, b.bodies[i].label);
    EXPECT_EQ(a.bodies[i].parts, b.bodies[i].parts);
  }
  EXPECT_NE(a.bodies.front().parts, other.bodies.front().parts);
}

TEST(SceneTest, IsFurnishedWithThingsOfManySizes) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Scene scene = MakeOffice(seed);
    EXPECT_GE(scene.bodies.size(), 12u) << seed;
    std::set<std::string> labels;
    double smallest = 1e9, largest = 0;
    for (const Body& body : scene.bodies) {
      labels.insert(body.label);
      smallest = std::min(smallest, Area(FootprintOf(body)));
      largest = std::max(largest, Area(FootprintOf(body)));
    }
    EXPECT_GE(labels.size(), 6u) << seed;
    EXPECT_LT(smallest, 0.03) << seed;
    EXPECT_GT(largest, 1.0) << seed;
  }
}

TEST(SceneTest, NothingStandsInAnotherOrInTheWay) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Scene scene = MakeOffice(seed);
    for (size_t i = 0; i < scene.bodies.size(); ++i) {
      const Polygon footprint = FootprintOf(scene.bodies[i]);
      EXPECT_TRUE(scene.bounds.Covers(footprint.bounds().min));
      EXPECT_TRUE(scene.bounds.Covers(footprint.bounds().max));
      for (const Point& p : scene.path) EXPECT_GT(Distance(footprint, p), 0.5);
      for (size_t j = 0; j < i; ++j) {
        EXPECT_FALSE(Collide(scene.bodies[i], scene.bodies[j]))
            << seed << ": " << scene.bodies[i].label << " in " << scene.bodies[j].label;
      }
    }
  }
}

TEST(SceneTest, PartsAreConvexAndCounterClockwise) {
  const Scene scene = MakeOffice(3);
  std::vector<Prism> parts = scene.structure;
  for (const Body& body : scene.bodies) {
    parts.insert(parts.end(), body.parts.begin(), body.parts.end());
  }
  for (const Prism& part : parts) {
    EXPECT_LT(part.low_m, part.high_m);
    EXPECT_TRUE(IsConvex(Polygon::MakeUnchecked({part.footprint})));
    EXPECT_EQ(Polygon::Make(part.footprint)->outer(), part.footprint);
  }
}

}  // namespace
}  // namespace hypermap::simulation
