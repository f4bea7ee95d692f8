#include "map/frames/frame_tree.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::RandomTransform;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

std::string Name(int i) { return "frame" + std::to_string(i); }

void ExpectTransformNear(const PlanarTransform& a, const PlanarTransform& b, double tolerance) {
  EXPECT_NEAR(a.x(), b.x(), tolerance);
  EXPECT_NEAR(a.y(), b.y(), tolerance);
  EXPECT_NEAR(std::remainder(a.yaw() - b.yaw(), 2 * std::numbers::pi), 0.0, tolerance);
}

TEST(FrameTreeTest, LooksUpAlongAndAcrossBranches) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"map", "odom", {10, 0, std::numbers::pi / 2}}).ok());
  ASSERT_TRUE(tree.Set({"odom", "robot", {2, 0, 0}}).ok());
  ASSERT_TRUE(tree.Set({"map", "lab", {0, 5, 0}}).ok());

  ExpectTransformNear(*tree.Lookup("map", "robot"), {10, 2, std::numbers::pi / 2}, 1e-12);
  ExpectTransformNear(*tree.Lookup("lab", "robot"), {10, -3, std::numbers::pi / 2}, 1e-12);
  ExpectTransformNear(*tree.Lookup("robot", "map"), tree.Lookup("map", "robot")->Inverse(), 1e-12);
  EXPECT_EQ(*tree.Lookup("map", "lab"), PlanarTransform(0, 5, 0));
  EXPECT_EQ(*tree.Lookup("lab", "map"), PlanarTransform(0, -5, 0));
}

TEST(FrameTreeTest, AFrameIsConnectedToItselfKnownOrNot) {
  EXPECT_TRUE(FrameTree().Lookup("nowhere", "nowhere")->IsIdentity());
}

TEST(FrameTreeTest, NamesBothFramesWhenTheyAreNotConnected) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"map", "odom", {}}).ok());
  ASSERT_TRUE(tree.Set({"world", "building", {}}).ok());
  for (const char* source : {"building", "world", "unheard_of"}) {
    const auto lookup = tree.Lookup("odom", source);
    EXPECT_EQ(lookup.status().code(), absl::StatusCode::kNotFound);
    EXPECT_EQ(std::string(lookup.status().message()),
              "no transform between frames 'odom' and '" + std::string(source) + "'");
  }
}

TEST(FrameTreeTest, ANewParentReplacesTheOld) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"map", "robot", {1, 0, 0}}).ok());
  ASSERT_TRUE(tree.Set({"world", "robot", {2, 0, 0}}).ok());
  EXPECT_THAT(tree.transforms(), ElementsAre(FrameTransform{"world", "robot", {2, 0, 0}}));
  EXPECT_FALSE(tree.Lookup("map", "robot").ok());
  EXPECT_FALSE(tree.Contains("map"));
  EXPECT_TRUE(tree.Contains("world"));
  EXPECT_TRUE(tree.Contains("robot"));
}

TEST(FrameTreeTest, RefusesWhatMakesNoForest) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"a", "b", {}}).ok());
  ASSERT_TRUE(tree.Set({"b", "c", {}}).ok());
  const std::vector<FrameTransform> before = tree.transforms();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const std::pair<FrameTransform, const char*> refused[] = {
      {{"c", "a", {}}, "own ancestor"},
      {{"c", "b", {}}, "own ancestor"},
      {{"a", "a", {}}, "own ancestor"},
      {{"", "d", {}}, "parent_frame_id must not be empty"},
      {{"a", "", {}}, "child_frame_id must not be empty"},
      {{"a", std::string(kMaxFrameIdBytes + 1, 'x'), {}}, "child_frame_id is longer than"},
      {{"a", "d", {nan, 0, 0}}, "parent_from_child is not finite"},
      {{"a", "d", {0, inf, 0}}, "parent_from_child is not finite"},
      {{"a", "d", {0, 0, inf}}, "parent_from_child is not finite"},
  };
  for (const auto& [transform, message] : refused) {
    const absl::Status status = tree.Set(transform);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
  }
  EXPECT_EQ(tree.transforms(), before);
  EXPECT_TRUE(tree.Set({"a", std::string(kMaxFrameIdBytes, 'x'), {}}).ok());
  EXPECT_THAT(FrameTree().transforms(), IsEmpty());
}

TEST(FrameTreeTest, FramesThatAreTooFarApartAreNotConnected) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"map", "corner", {1e9, 1e9, 0.5}}).ok());
  ASSERT_TRUE(tree.Set({"corner", "east", {1e9, 0, 0}}).ok());
  ASSERT_TRUE(tree.Set({"corner", "back", {-1e9, -1e9, 0}}).ok());
  ASSERT_TRUE(tree.Set({"east", "robot", {1, 2, 0}}).ok());
  for (const auto& [target, source] : {std::pair{"map", "east"}, std::pair{"robot", "map"}}) {
    const auto lookup = tree.Lookup(target, source);
    EXPECT_TRUE(absl::IsInvalidArgument(lookup.status())) << lookup.status();
    EXPECT_THAT(std::string(lookup.status().message()), HasSubstr("more than 2e+09 m apart"));
    EXPECT_THAT(std::string(lookup.status().message()), HasSubstr("'map'"));
  }
  EXPECT_TRUE(tree.Lookup("map", "corner").ok());
  EXPECT_TRUE(tree.Lookup("map", "back").ok());
  EXPECT_EQ(*tree.Lookup("east", "robot"), PlanarTransform(1, 2, 0));
}

// Transforms that were stored before there was a bound stay, and make no answer infinite.
TEST(FrameTreeTest, LookupThroughATransformBeyondTheBoundIsRefused) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"map", "half", {1e308, 1e308, 0.5}}).ok());
  ASSERT_TRUE(tree.Set({"half", "far", {1e308, 1e308, 0.5}}).ok());
  ASSERT_TRUE(tree.Set({"half", "back", {-1e308, -1e308, 0}}).ok());
  ASSERT_TRUE(tree.Set({"map", "odom", {1, 0, 0}}).ok());
  const std::pair<const char*, const char*> refused[] = {
      {"map", "half"}, {"half", "map"}, {"map", "far"}, {"far", "odom"}, {"back", "map"}};
  for (const auto& [target, source] : refused) {
    const auto lookup = tree.Lookup(target, source);
    EXPECT_TRUE(absl::IsInvalidArgument(lookup.status())) << target << " " << source;
    EXPECT_THAT(std::string(lookup.status().message()), HasSubstr("x or y is more than 1e+09 m"));
  }
  EXPECT_TRUE(tree.Lookup("far", "far").ok());
  EXPECT_TRUE(tree.Lookup("map", "odom").ok());
  // Another transform in its place mends it.
  ASSERT_TRUE(tree.Set({"map", "half", {1, 0, 0}}).ok());
  EXPECT_TRUE(tree.Lookup("map", "half").ok());
}

TEST(FrameTreeTest, LookupsComposeInRandomForests) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  int connected = 0;
  for (int i = 0; i < 50; ++i) {
    FrameTree tree;
    constexpr int kFrames = 20;
    // Frames without a parent are roots. The first edge that names a frame makes it known.
    std::vector<int> root(kFrames);
    for (int child = 0; child < kFrames; ++child) {
      root[child] = child;
      if (child < 2) continue;
      const int parent = UniformInt(rng, 0, child - 1);
      ASSERT_TRUE(tree.Set({Name(parent), Name(child), RandomTransform(rng, 10)}).ok());
      root[child] = root[parent];
    }
    for (int j = 0; j < 50; ++j) {
      const int a = UniformInt(rng, 0, kFrames - 1), b = UniformInt(rng, 0, kFrames - 1),
                c = UniformInt(rng, 0, kFrames - 1);
      const auto a_from_b = tree.Lookup(Name(a), Name(b));
      const auto b_from_c = tree.Lookup(Name(b), Name(c));
      const auto a_from_c = tree.Lookup(Name(a), Name(c));
      ASSERT_EQ(a_from_b.ok(), root[a] == root[b]);
      ASSERT_EQ(a_from_c.ok(), root[a] == root[c]);
      if (!a_from_b.ok() || !b_from_c.ok()) continue;
      ++connected;
      ExpectTransformNear(*a_from_b * *b_from_c, *a_from_c, 1e-9);
      ExpectTransformNear(*tree.Lookup(Name(b), Name(a)), a_from_b->Inverse(), 1e-9);
    }
  }
  EXPECT_GT(connected, 300);
}

TEST(FrameTreeTest, KnowsParentsWhileTheyHaveChildren) {
  FrameTree tree;
  ASSERT_TRUE(tree.Set({"map", "a", {}}).ok());
  ASSERT_TRUE(tree.Set({"map", "b", {}}).ok());
  ASSERT_TRUE(tree.Set({"map", "b", {1, 0, 0}}).ok());
  ASSERT_TRUE(tree.Set({"b", "a", {}}).ok());
  EXPECT_TRUE(tree.Contains("map"));
  EXPECT_TRUE(tree.HasChildren("map"));
  EXPECT_FALSE(tree.HasChildren("a"));
  EXPECT_EQ(tree.size(), 2u);
  EXPECT_EQ(tree.Find("a")->parent_frame_id, "b");
  EXPECT_EQ(tree.Find("map"), nullptr);
  ASSERT_TRUE(tree.Set({"world", "b", {}}).ok());
  EXPECT_FALSE(tree.Contains("map"));
}

// Accepts and refuses the same transforms as a check of all ancestors does.
TEST(FrameTreeTest, RefusesCyclesInRandomForests) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  constexpr int kFrames = 12;
  std::vector<int> parent(kFrames, -1);
  FrameTree tree;
  int refused = 0;
  for (int i = 0; i < 2000; ++i) {
    const int child = UniformInt(rng, 0, kFrames - 1), above = UniformInt(rng, 0, kFrames - 1);
    bool is_cycle = false;
    for (int frame = above; frame >= 0; frame = parent[frame]) is_cycle |= frame == child;
    ASSERT_EQ(tree.Set({Name(above), Name(child), {}}).ok(), !is_cycle);
    if (!is_cycle) parent[child] = above;
    refused += is_cycle;
  }
  EXPECT_GT(refused, 100);
}

TEST(FrameTreeTest, B3CopiesShareAllButTheFrameThatWasSet) {
  FrameTree tree;
  int64_t bytes = 0;
  constexpr int kFrames = 12'000;
  for (int i = 0; i < kFrames; ++i) {
    const FrameTree before = tree;
    // A chain in one half, a star in the other.
    const std::string parent = i % 2 != 0 && i > 1 ? Name(i - 2) : "map";
    ASSERT_TRUE(tree.Set({parent, Name(i), {}}).ok());
    bytes += tree.UnsharedBytes(before);
    ASSERT_EQ(FrameTree(tree).UnsharedBytes(tree), 0);
  }
  EXPECT_LT(bytes / kFrames, 8192);
  EXPECT_GT(tree.UnsharedBytes(FrameTree()), int64_t{kFrames} * 100);
}

}  // namespace
}  // namespace hypermap
