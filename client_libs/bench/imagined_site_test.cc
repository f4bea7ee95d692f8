#include "client_libs/bench/imagined_site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "absl/time/clock.h"

namespace hypermap::bench {
namespace {

TEST(ImaginedSiteTest, ObservationsAreValidAndShowOneToThreeThings) {
  for (const int things : {1, 2, 200}) {
    const ImaginedSite site(1, things);
    Random random = RandomOf(1, RandomRole::kEdit, 1);
    for (int i = 0; i < 200; ++i) {
      const Observation observation = site.Observe("robot", i, absl::Now(), random);
      EXPECT_TRUE(Validate(observation).ok()) << Validate(observation);
      EXPECT_GE(observation.detections.size(), 1U);
      EXPECT_LE(observation.detections.size(), 3U);
      EXPECT_EQ(observation.sequence, i);
    }
  }
}

TEST(ImaginedSiteTest, EditedObjectsAreValidAndOfAllShapes) {
  const ImaginedSite site(1, 50);
  Random random = RandomOf(1, RandomRole::kEdit, 1);
  std::set<ShapeKind> kinds;
  for (int64_t number = 0; number < 12; ++number) {
    const SemanticObject object = site.EditedObject(number, random);
    EXPECT_TRUE(Validate(object).ok());
    kinds.insert(object.shape.kind());
  }
  EXPECT_EQ(kinds.size(), 3U);
}

TEST(ImaginedSiteTest, BatchesHaveTheAskedNumberOfPoints) {
  const ImaginedSite site(1, 50);
  Random random = RandomOf(1, RandomRole::kEdit, 1);
  EXPECT_EQ(site.AskedPoints(64, random).size(), 64U);
}

TEST(ImaginedSiteTest, DependsOnTheSeedOnly) {
  const ImaginedSite a(1, 50);
  const ImaginedSite b(1, 50);
  Random of_a = RandomOf(1, RandomRole::kEdit, 1);
  Random of_b = RandomOf(1, RandomRole::kEdit, 1);
  const absl::Time now = absl::Now();
  EXPECT_EQ(a.Observe("robot", 1, now, of_a).detections,
            b.Observe("robot", 1, now, of_b).detections);
}

}  // namespace
}  // namespace hypermap::bench
