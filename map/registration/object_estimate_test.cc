#include "map/registration/object_estimate.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "tests/support/random_map.h"

namespace hypermap::registration {
namespace {

using hypermap::testing::Rng;
using hypermap::testing::TestSeed;
using hypermap::testing::Uniform;
using hypermap::testing::UniformInt;

const PlanarTransform kTrueOfObjects(-12.0, 30.0, -1.1);

struct Thing {
  std::string label;
  Point place;
  double side_m;
};

std::shared_ptr<const SemanticLayer> LayerOf(const std::vector<Thing>& things) {
  std::vector<ObjectPtr> objects;
  for (const Thing& thing : things) {
    SemanticObject object;
    object.id = static_cast<ObjectId>(objects.size()) + 1;
    object.label = thing.label;
    const double half = 0.5 * thing.side_m;
    object.shape = Polygon::FromBox({{thing.place.x - half, thing.place.y - half},
                                     {thing.place.x + half, thing.place.y + half}});
    objects.push_back(std::make_shared<const SemanticObject>(std::move(object)));
  }
  return std::make_shared<const SemanticLayer>(
      LayerSpec{.name = "objects", .kind = LayerKind::kSemantic, .frame_id = "map"}, objects);
}

std::vector<Thing> Office(Rng& rng) {
  std::vector<Thing> things;
  for (const auto& [label, number, side_m] :
       {std::tuple("chair", 12, 0.5), std::tuple("table", 5, 1.2), std::tuple("plant", 3, 0.4),
        std::tuple("sofa", 2, 1.8)}) {
    for (int i = 0; i < number; ++i) {
      things.push_back({label, {Uniform(rng, 0.0, 15.0), Uniform(rng, 0.0, 10.0)}, side_m});
    }
  }
  return things;
}

// Returns what another robot has seen of them: most, at slightly other places and sizes, and a few
// things that are not there.
std::vector<Thing> SeenFromTarget(Rng& rng, const std::vector<Thing>& things) {
  std::vector<Thing> seen;
  for (const Thing& thing : things) {
    if (UniformInt(rng, 0, 2) == 0) continue;
    Point place = kTrueOfObjects * thing.place;
    place.x += Uniform(rng, -0.05, 0.05);
    place.y += Uniform(rng, -0.05, 0.05);
    seen.push_back({thing.label, place, thing.side_m * Uniform(rng, 0.8, 1.2)});
  }
  for (int i = 0; i < 4; ++i) {
    const Point place = kTrueOfObjects * Point{Uniform(rng, 0.0, 15.0), Uniform(rng, 0.0, 10.0)};
    seen.push_back({"Chair", place, 0.5});
  }
  return seen;
}

TEST(EstimateFromObjectsTest, AnotherRobotsObjectsAreLaidOverTheirs) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  int confident = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const std::vector<Thing> things = Office(rng);
    const auto estimate =
        EstimateFromObjects(*LayerOf(things), *LayerOf(SeenFromTarget(rng, things)));
    ASSERT_TRUE(estimate.ok()) << estimate.status();
    if (estimate->ambiguity != Ambiguity::kNone) continue;
    ++confident;
    const Point middle = estimate->best.target_from_source * Point{7.5, 5.0};
    const Point true_middle = kTrueOfObjects * Point{7.5, 5.0};
    EXPECT_LT(std::hypot(middle.x - true_middle.x, middle.y - true_middle.y), 0.1);
    EXPECT_LT(std::abs(estimate->best.target_from_source.yaw() - kTrueOfObjects.yaw()), 0.03);
  }
  EXPECT_GE(confident, 18);
}

TEST(EstimateFromObjectsTest, OtherObjectsAreNoAnswer) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE(seed);
  Rng rng(seed);
  for (int trial = 0; trial < 20; ++trial) {
    const auto estimate = EstimateFromObjects(*LayerOf(Office(rng)), *LayerOf(Office(rng)));
    ASSERT_TRUE(estimate.ok()) << estimate.status();
    EXPECT_NE(estimate->ambiguity, Ambiguity::kNone) << estimate->best.score;
  }
}

TEST(EstimateFromObjectsTest, RowOfLikeThingsIsAmbiguous) {
  std::vector<Thing> things;
  things.reserve(10);
  for (int i = 0; i < 10; ++i) things.push_back({"desk", {2.0 * i, 0.0}, 1.0});
  const auto estimate = EstimateFromObjects(*LayerOf(things), *LayerOf(things));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_EQ(estimate->ambiguity, Ambiguity::kRunnerUp);
}

// A mirrored set has the same distances, but no rotation leads to it.
TEST(EstimateFromObjectsTest, MirrorImageIsNoAnswer) {
  Rng rng(4);
  const std::vector<Thing> things = Office(rng);
  std::vector<Thing> mirrored = things;
  for (Thing& thing : mirrored) thing.place.x = -thing.place.x;
  const auto estimate = EstimateFromObjects(*LayerOf(things), *LayerOf(mirrored));
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_NE(estimate->ambiguity, Ambiguity::kNone);
}

TEST(EstimateFromObjectsTest, LabelsAndSizesMustAgree) {
  const auto status = [](const Thing& source, const Thing& target) {
    return EstimateFromObjects(*LayerOf({source}), *LayerOf({target})).status();
  };
  EXPECT_EQ(status({"chair", {0, 0}, 0.5}, {"table", {0, 0}, 0.5}).code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status({"chair", {0, 0}, 0.5}, {"chair", {0, 0}, 1.0}).code(),
            absl::StatusCode::kFailedPrecondition);
  EXPECT_TRUE(status({"chair", {0, 0}, 0.5}, {"CHAIR", {0, 0}, 0.7}).ok());
}

}  // namespace
}  // namespace hypermap::registration
