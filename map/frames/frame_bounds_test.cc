#include "map/frames/frame_bounds.h"

#include <algorithm>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

std::string FrameName(int i) { return "frame" + std::to_string(i); }

// A tree whose transforms are checked as those of a batch are.
struct CheckedTree {
  absl::Status Set(const std::string& parent, const std::string& child,
                   const PlanarTransform& t = {}) {
    if (absl::Status refused = bounds.Check(frames, {parent, child, t}); !refused.ok()) {
      return refused;
    }
    return frames.Set({parent, child, t});
  }

  FrameTree frames;
  FrameBounds bounds;
};

// A chain from "map" over frame0 to frame(length - 1), which nothing has checked.
FrameTree Chain(int length) {
  FrameTree frames;
  for (int i = 0; i < length; ++i) {
    EXPECT_TRUE(frames.Set({i == 0 ? "map" : FrameName(i - 1), FrameName(i), {}}).ok());
  }
  return frames;
}

TEST(FrameBoundsTest, RefusesTranslationsBeyondTheBoundOfCoordinates) {
  CheckedTree tree;
  EXPECT_TRUE(tree.Set("map", "corner", {kMaxCoordinate_m, -kMaxCoordinate_m, 0.5}).ok());
  for (const PlanarTransform& far :
       {PlanarTransform(1.001e9, 0, 0), PlanarTransform(0, -1e308, 0.5)}) {
    const absl::Status refused = tree.Set("map", "far", far);
    EXPECT_TRUE(absl::IsInvalidArgument(refused)) << refused;
    EXPECT_EQ(refused.message(), "parent_from_child: x or y is more than 1e+09 m");
    EXPECT_FALSE(tree.Set("map", "corner", far).ok());
  }
  EXPECT_EQ(tree.frames.size(), 1u);
}

TEST(FrameBoundsTest, EveryTransformThatItAcceptsCanBeLookedUpInBothDirections) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int i = 0; i < 1000; ++i) {
    CheckedTree tree;
    const double x = UniformInt(rng, 0, 1) == 0 ? kMaxCoordinate_m : -kMaxCoordinate_m;
    ASSERT_TRUE(tree.Set("map", "far", {x, kMaxCoordinate_m, testing::Uniform(rng, -4, 4)}).ok());
    ASSERT_TRUE(tree.frames.Lookup("map", "far").ok());
    ASSERT_TRUE(tree.frames.Lookup("far", "map").ok());
  }
}

TEST(FrameBoundsTest, ErrorsOfTheTreeComeFirst) {
  CheckedTree tree;
  ASSERT_TRUE(tree.Set("map", "a").ok());
  EXPECT_THAT(std::string(tree.Set("", "b").message()), HasSubstr("parent_frame_id must not be"));
  EXPECT_THAT(std::string(tree.Set("a", "map").message()), HasSubstr("its own ancestor"));
  EXPECT_THAT(std::string(tree.Set("a", "a").message()), HasSubstr("its own ancestor"));
  // A refused transform leaves no trace.
  EXPECT_TRUE(tree.Set("earth", "map").ok());
}

TEST(FrameBoundsTest, DepthIsBoundedAtTheLeaves) {
  CheckedTree tree;
  ASSERT_TRUE(tree.Set("map", FrameName(1)).ok());
  for (int i = 2; i <= kMaxFrameDepth; ++i)
    ASSERT_TRUE(tree.Set(FrameName(i - 1), FrameName(i)).ok()) << i;
  const absl::Status refused = tree.Set(FrameName(kMaxFrameDepth), "deeper");
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_THAT(std::string(refused.message()), HasSubstr("frame 'deeper'"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("more than 256 transforms"));
  // A transform that only moves the frame is no deeper.
  EXPECT_TRUE(tree.Set(FrameName(kMaxFrameDepth - 1), FrameName(kMaxFrameDepth), {1, 2, 3}).ok());
}

TEST(FrameBoundsTest, DepthIsBoundedForTheFramesBelowAFrameThatMoves) {
  const FrameTree chain = Chain(200);  // frame0 has 199 frames below it.
  const std::string below_map[] = {"map", FrameName(0), FrameName(100)};
  for (const std::string& moved : below_map) {
    for (const int above : {10, 56, 57, 156, 157, 200}) {
      CheckedTree tree;
      tree.frames = chain;
      std::string parent = "root";
      for (int i = 0; i < above; ++i) {
        const std::string child = "above" + std::to_string(i);
        ASSERT_TRUE(tree.Set(parent, child).ok());
        parent = child;
      }
      const int height = moved == "map" ? 200 : moved == FrameName(0) ? 199 : 99;
      const absl::Status set = tree.Set(parent, moved);
      EXPECT_EQ(set.ok(), above + 1 + height <= kMaxFrameDepth) << moved << " below " << above;
      EXPECT_TRUE(set.ok() || absl::IsResourceExhausted(set)) << set;
    }
  }
}

TEST(FrameBoundsTest, NumberOfTransformsIsBounded) {
  CheckedTree tree;
  for (int64_t i = 0; i < kMaxFrames; ++i) {
    ASSERT_TRUE(tree.Set("map", FrameName(static_cast<int>(i))).ok()) << i;
  }
  const absl::Status refused = tree.Set("map", "one more");
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(refused.message(), "the map has 20000 transforms, the most are 20000");
  EXPECT_TRUE(tree.Set(FrameName(1), FrameName(0)).ok());
}

TEST(FrameBoundsTest, TreesBeyondTheBoundsCanBeUsedAndRepaired) {
  CheckedTree tree;
  constexpr int kLength = 1000;
  tree.frames = Chain(kLength);
  EXPECT_TRUE(tree.Set(FrameName(kLength - 2), FrameName(kLength - 1), {1, 0, 0}).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(tree.Set(FrameName(kLength - 1), "deeper")));
  EXPECT_TRUE(absl::IsResourceExhausted(tree.Set("map", FrameName(500))));
  // The lower ends of the chain are tied to its root, the lowest first.
  for (int end = kLength; end > 0; end -= kMaxFrameDepth) {
    ASSERT_TRUE(tree.Set("map", FrameName(std::max(0, end - kMaxFrameDepth))).ok()) << end;
  }
  EXPECT_TRUE(tree.frames.Lookup("map", FrameName(kLength - 1)).ok());
  EXPECT_TRUE(absl::IsResourceExhausted(tree.Set(FrameName(kLength - 1), "deeper")));
  EXPECT_TRUE(tree.Set(FrameName(kLength - 2), "as deep").ok());
}

// Accepts the transforms that an oracle accepts, which walks through all frames.
TEST(FrameBoundsTest, AgreesWithAWalkThroughAllFrames) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  // Long chains, so that many transforms are at the bound.
  constexpr int kChains = 8, kLength = 60, kFrames = kChains * kLength;
  std::vector<int> parent(kFrames, -1);
  CheckedTree tree;
  for (int i = 0; i < kFrames; ++i) {
    if (i % kLength == 0) continue;
    ASSERT_TRUE(tree.Set(FrameName(i - 1), FrameName(i)).ok());
    parent[i] = i - 1;
  }
  const auto depth_of = [&](int frame) {
    int depth = 0;
    for (; parent[frame] >= 0; frame = parent[frame]) ++depth;
    return depth;
  };
  int refused = 0;
  const auto tie = [&](int above, int child) {
    const int before = parent[child];
    bool is_cycle = false;
    for (int frame = above; frame >= 0; frame = parent[frame]) is_cycle |= frame == child;
    int deepest = 0;
    if (!is_cycle) {
      parent[child] = above;
      for (int frame = 0; frame < kFrames; ++frame) deepest = std::max(deepest, depth_of(frame));
    }
    const absl::Status set = tree.Set(FrameName(above), FrameName(child));
    if (is_cycle) {
      ASSERT_TRUE(absl::IsInvalidArgument(set) || absl::IsResourceExhausted(set)) << set;
      return;
    }
    ASSERT_EQ(set.ok(), deepest <= kMaxFrameDepth || before == above) << set;
    if (set.ok()) return;
    parent[child] = before;
    ++refused;
  };
  for (int head = kLength; head < kFrames; head += kLength) tie(head - 1, head);
  EXPECT_GT(refused, 0);
  for (int i = 0; i < 800 && !HasFatalFailure(); ++i) {
    // Mostly ties high frames to deep ones, so that many transforms exceed the bound.
    int child = UniformInt(rng, 0, kFrames - 1), above = UniformInt(rng, 0, kFrames - 1);
    for (int j = UniformInt(rng, 0, 12); j > 0; --j) {
      const int other = UniformInt(rng, 0, kFrames - 1);
      if (depth_of(other) < depth_of(child)) child = other;
      if (depth_of(other) > depth_of(above)) above = other;
    }
    tie(above, child);
  }
}

using Parents = std::vector<std::pair<std::string, std::string>>;  // Parent and child.

int64_t VisitsFor(const Parents& parents) {
  CheckedTree tree;
  for (const auto& [parent, child] : parents) {
    EXPECT_TRUE(tree.Set(parent, child).ok()) << parent << " " << child;
  }
  return tree.bounds.num_visits();
}

// Chains as long as allowed, made from their roots on.
Parents ChainsDown(int frames) {
  Parents parents;
  for (int i = 0; i < frames; ++i) {
    parents.emplace_back(i % kMaxFrameDepth == 0 ? "map" : FrameName(i - 1), FrameName(i));
  }
  return parents;
}

// The same chains, made from their ends on.
Parents ChainsUp(int frames) {
  Parents parents = ChainsDown(frames);
  std::reverse(parents.begin(), parents.end());
  return parents;
}

// A frame with many below it, which moves to and fro.
Parents MovingStar(int frames) {
  Parents parents{{"map", "left"}, {"map", "right"}, {"left", "hub"}};
  for (int i = 0; i < frames; ++i) parents.emplace_back("hub", FrameName(i));
  for (int i = 0; i < frames; ++i) parents.emplace_back(i % 2 == 0 ? "right" : "left", "hub");
  return parents;
}

// The lower half of a long chain, which moves to and fro, beside many other frames.
Parents MovingChain(int frames) {
  Parents parents;
  for (int i = 0; i < frames; ++i) parents.emplace_back("map", "other" + std::to_string(i));
  for (int i = 0; i < 128; ++i)
    parents.emplace_back(i == 0 ? "map" : FrameName(i - 1), FrameName(i));
  for (int i = 0; i < frames; ++i) {
    parents.emplace_back(i % 2 == 0 ? "other0" : FrameName(62), FrameName(64));
  }
  return parents;
}

TEST(FrameBoundsTest, CostOfABatchGrowsWithItsTransforms) {
  for (const auto& [name, make] :
       std::map<std::string, Parents (*)(int)>{{"chains down", ChainsDown},
                                               {"chains up", ChainsUp},
                                               {"moving star", MovingStar},
                                               {"moving chain", MovingChain}}) {
    SCOPED_TRACE(name);
    const int64_t small = VisitsFor(make(2500)), large = VisitsFor(make(10'000));
    EXPECT_GT(small, 0);
    EXPECT_LE(large, 5 * small);
    EXPECT_LE(large, int64_t{10'000} * 3 * kMaxFrameDepth);
  }
}

}  // namespace
}  // namespace hypermap
