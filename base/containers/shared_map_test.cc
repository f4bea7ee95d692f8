#include "base/containers/shared_map.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

using Numbers = SharedMap<int, int>;

std::vector<std::pair<int, int>> EntriesOf(const Numbers& numbers) {
  return {numbers.begin(), numbers.end()};
}

int64_t NumUnshared(const Numbers& now, const Numbers& older) {
  int64_t num_nodes = 0;
  now.VisitUnshared(older, [&](const auto& /*entry*/, const auto* /*before*/) { ++num_nodes; });
  return num_nodes;
}

TEST(SharedMapTest, CopyStaysAsItWas) {
  SharedMap<std::string, int> ages{{"bob", 7}, {"ann", 41}};
  const auto before = ages;
  ages.insert_or_assign("bob", 8);
  ages.insert_or_assign("eve", 3);
  EXPECT_EQ(ages.erase("ann"), 1u);
  EXPECT_EQ(ages.erase("ann"), 0u);
  EXPECT_THAT(before, ElementsAre(Pair("ann", 41), Pair("bob", 7)));
  EXPECT_THAT(ages, ElementsAre(Pair("bob", 8), Pair("eve", 3)));
  EXPECT_FALSE(before == ages);
  EXPECT_EQ(ages.find("eve")->second, 3);
  EXPECT_EQ(ages.find("ann"), ages.end());
  ages.clear();
  EXPECT_THAT(ages, IsEmpty());
}

TEST(SharedMapTest, AlgorithmsInsertWhatIsNotThere) {
  const std::map<int, int> plain{{1, 10}, {3, 30}};
  Numbers numbers{{3, 31}};
  std::copy(plain.begin(), plain.end(), std::inserter(numbers, numbers.begin()));
  EXPECT_THAT(numbers, ElementsAre(Pair(1, 10), Pair(3, 31)));
}

TEST(SharedMapTest, IsEqualByItsEntriesHoweverItWasMade) {
  Numbers up, down;
  for (int i = 0; i < 100; ++i) up.insert_or_assign(i, i * i);
  for (int i = 99; i >= 0; --i) down.insert_or_assign(i, i * i);
  EXPECT_EQ(up, down);
  down.insert_or_assign(50, 0);
  EXPECT_FALSE(up == down);
}

TEST(SharedMapTest, BehavesAsAStdMapUnderRandomChanges) {
  std::mt19937 rng(17);
  Numbers shared;
  std::map<int, int> plain;
  for (int step = 0; step < 5000; ++step) {
    const int key = static_cast<int>(rng() % 300);
    const Numbers before = shared;
    if (rng() % 3 == 0) {
      ASSERT_EQ(shared.erase(key), plain.erase(key));
    } else {
      shared.insert_or_assign(key, step);
      plain.insert_or_assign(key, step);
    }
    ASSERT_EQ(shared.size(), plain.size());
    ASSERT_EQ(shared.contains(key), plain.contains(key));
    const auto found = shared.find(key);
    if (found != shared.end()) {
      // An iterator that find returns continues in order.
      const auto next = std::next(found);
      const auto plain_next = plain.upper_bound(key);
      ASSERT_EQ(next == shared.end(), plain_next == plain.end());
      if (next != shared.end()) {
        ASSERT_EQ(next->first, plain_next->first);
      }
    }
    // An AVL tree of 300 nodes is at most 11 high; a removal may rotate at each height, and a
    // rotation makes up to three nodes.
    ASSERT_LE(NumUnshared(shared, before), 33);
    if (step % 100 == 0) {
      ASSERT_EQ(EntriesOf(shared), (std::vector<std::pair<int, int>>(plain.begin(), plain.end())));
    }
  }
}

TEST(SharedMapTest, B3KeepingEachOfManyVersionsCostsWhatChanges) {
  Numbers now;
  int64_t num_nodes = 0;
  constexpr int kVersions = 4096;
  for (int i = 0; i < kVersions; ++i) {
    const Numbers before = now;
    now.insert_or_assign(i, i);
    num_nodes += NumUnshared(now, before);
  }
  EXPECT_LE(num_nodes, kVersions * 14);
}

TEST(SharedMapTest, VisitsTheEntriesThatDiffer) {
  Numbers older;
  for (int i = 0; i < 1000; ++i) older.insert_or_assign(i, i);
  Numbers now = older;
  now.insert_or_assign(500, -1);
  now.insert_or_assign(2000, 2000);
  now.erase(7);
  std::map<int, std::pair<int, int>> differ;  // Value now and before; 0 stands for none.
  now.VisitUnshared(older, [&](const auto& entry, const auto* before) {
    if (before != &entry) differ[entry.first] = {entry.second, before ? before->second : 0};
  });
  older.VisitUnshared(now, [&](const auto& entry, const auto* after) {
    if (!after) differ[entry.first] = {0, entry.second};
  });
  EXPECT_THAT(differ, ElementsAre(Pair(7, Pair(0, 7)), Pair(500, Pair(-1, 500)),
                                  Pair(2000, Pair(2000, 0))));
}

}  // namespace
}  // namespace hypermap
