#include "map/evaluation/pairing.h"

#include <cmath>
#include <set>
#include <tuple>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap::evaluation {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Rng;
using testing::TestSeed;
using testing::Uniform;
using testing::UniformInt;

using Indexes = std::pair<int, int>;

std::vector<Indexes> IndexesOf(const std::vector<Candidate>& pairs) {
  std::vector<Indexes> indexes;
  for (const Candidate& c : pairs) indexes.emplace_back(c.left, c.right);
  return indexes;
}

// Number of pairs, sum of gains, and negated sum of costs; greater is better.
using Worth = std::tuple<int, double, double>;

Worth WorthOf(const std::vector<Candidate>& pairs) {
  double gain = 0.0, cost = 0.0;
  for (const Candidate& c : pairs) {
    gain += c.gain;
    cost += c.cost;
  }
  return {static_cast<int>(pairs.size()), gain, -cost};
}

// Tries to take and to leave each candidate in turn.
Worth BestByTrying(const std::vector<Candidate>& candidates, size_t next, std::set<int>& left,
                   std::set<int>& right, std::vector<Candidate>& taken) {
  if (next == candidates.size()) return WorthOf(taken);
  Worth best = BestByTrying(candidates, next + 1, left, right, taken);
  const Candidate& c = candidates[next];
  if (left.contains(c.left) || right.contains(c.right)) return best;
  left.insert(c.left);
  right.insert(c.right);
  taken.push_back(c);
  best = std::max(best, BestByTrying(candidates, next + 1, left, right, taken));
  taken.pop_back();
  left.erase(c.left);
  right.erase(c.right);
  return best;
}

TEST(BestPairingTest, OfNothingIsNothing) { EXPECT_THAT(BestPairing({}), IsEmpty()); }

TEST(BestPairingTest, PrefersMorePairsToMoreGain) {
  const std::vector<Candidate> pairs = BestPairing({{0, 0, 0.1}, {0, 1, 0.9}, {1, 1, 0.0}});
  EXPECT_THAT(IndexesOf(pairs), ElementsAre(Indexes(0, 0), Indexes(1, 1)));
}

TEST(BestPairingTest, PrefersMoreGainToLessCost) {
  const std::vector<Candidate> pairs = BestPairing({{7, 3, 0.2, 0.0}, {7, 4, 0.3, 900.0}});
  EXPECT_THAT(IndexesOf(pairs), ElementsAre(Indexes(7, 4)));
}

TEST(BestPairingTest, TakesLessCostWhereTheGainIsTheSame) {
  const std::vector<Candidate> pairs =
      BestPairing({{0, 0, 0.0, 0.5}, {0, 1, 0.0, 0.1}, {1, 0, 0.0, 0.2}, {1, 1, 0.0, 0.1}});
  EXPECT_THAT(IndexesOf(pairs), ElementsAre(Indexes(0, 1), Indexes(1, 0)));
}

// A greedy choice of the best single pair would miss the best pairing.
TEST(BestPairingTest, GivesUpTheBestPairForABetterWhole) {
  const std::vector<Candidate> pairs =
      BestPairing({{0, 0, 0.9}, {0, 1, 0.8}, {1, 0, 0.8}, {1, 1, 0.1}});
  EXPECT_THAT(IndexesOf(pairs), ElementsAre(Indexes(0, 1), Indexes(1, 0)));
}

TEST(BestPairingTest, IsAsGoodAsTryingAll) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  for (int round = 0; round < 2000; ++round) {
    const int n_left = UniformInt(rng, 1, 5), n_right = UniformInt(rng, 1, 5);
    const double density = Uniform(rng, 0.1, 1.0);
    const bool ties = UniformInt(rng, 0, 1) == 1;
    std::vector<Candidate> candidates;
    for (int l = 0; l < n_left; ++l) {
      for (int r = 0; r < n_right; ++r) {
        if (Uniform(rng, 0, 1) > density || candidates.size() == 14) continue;
        const double gain = ties ? UniformInt(rng, 0, 2) / 2.0 : Uniform(rng, 0, 1);
        candidates.push_back({l, r, gain, ties ? UniformInt(rng, 0, 3) : Uniform(rng, 0, 1)});
      }
    }
    std::set<int> left, right;
    std::vector<Candidate> taken;
    const auto [count, gain, cost] = BestByTrying(candidates, 0, left, right, taken);
    const std::vector<Candidate> pairs = BestPairing(candidates);
    ASSERT_EQ(std::get<0>(WorthOf(pairs)), count);
    ASSERT_NEAR(std::get<1>(WorthOf(pairs)), gain, 1e-8);
    if (ties) {
      ASSERT_NEAR(std::get<2>(WorthOf(pairs)), cost, 1e-8);
    }
    for (const Candidate& c : pairs) {
      ASSERT_TRUE(left.insert(c.left).second);
      ASSERT_TRUE(right.insert(c.right).second);
    }
  }
}

TEST(BestPairingTest, PairsThousandsThatAreNotAllAroundOnePlace) {
  std::vector<Candidate> candidates;
  for (int i = 0; i < 5000; ++i) {
    candidates.push_back({i, i, 0.5});
    candidates.push_back({i, i ^ 1, 0.6});
  }
  const std::vector<Candidate> pairs = BestPairing(candidates);
  ASSERT_EQ(pairs.size(), 5000u);
  for (const Candidate& c : pairs) EXPECT_EQ(c.right, c.left ^ 1);
}

}  // namespace
}  // namespace hypermap::evaluation
