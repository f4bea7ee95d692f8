#include "base/admission/content_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace hypermap::admission {
namespace {

TEST(ContentBudgetTest, GrowthBeyondTheLimitIsRefusedByItsName) {
  const auto budget = std::make_shared<ContentBudget>(1000);
  ContentBudget::Share first(budget, 300);
  ContentBudget::Share second(budget, 200);
  EXPECT_TRUE(first.Grow(400).ok());
  EXPECT_EQ(budget->room(), 100);
  const absl::Status refused = second.Grow(101);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_EQ(std::string(refused.message()),
            "the content of the map would grow by 101 bytes of memory to 301, and that of all maps "
            "to 1001: --max_content_bytes is 1000");
  EXPECT_EQ(second.bytes(), 200);
  EXPECT_TRUE(second.Grow(100).ok());
  EXPECT_EQ(budget->bytes(), 1000);
  EXPECT_EQ(budget->room(), 0);
}

TEST(ContentBudgetTest, AboveTheLimitContentMayShrinkAndStay) {
  const auto budget = std::make_shared<ContentBudget>(1000);
  ContentBudget::Share loaded(budget, 5000);
  EXPECT_EQ(budget->room(), 0);
  EXPECT_FALSE(loaded.Grow(1).ok());
  EXPECT_TRUE(loaded.Grow(0).ok());
  EXPECT_TRUE(loaded.Grow(-3500).ok());
  EXPECT_EQ(budget->bytes(), 1500);
  EXPECT_FALSE(loaded.Grow(1).ok());
  loaded.Add(-600);
  EXPECT_TRUE(loaded.Grow(100).ok());
  loaded.Add(700);
  EXPECT_EQ(budget->bytes(), 1700);
}

TEST(ContentBudgetTest, WhatAMapTookIsGivenBackWithIt) {
  const auto budget = std::make_shared<ContentBudget>(1000);
  {
    const ContentBudget::Share gone(budget, 1000);
    EXPECT_EQ(budget->room(), 0);
  }
  EXPECT_EQ(budget->bytes(), 0);
  EXPECT_EQ(budget->room(), 1000);
}

TEST(ContentBudgetTest, WithoutALimitContentIsOnlyCounted) {
  const auto budget = std::make_shared<ContentBudget>();
  ContentBudget::Share share(budget, 7);
  EXPECT_TRUE(share.Grow(int64_t{1} << 50).ok());
  EXPECT_EQ(budget->bytes(), (int64_t{1} << 50) + 7);
  EXPECT_EQ(budget->room(), std::numeric_limits<int64_t>::max());
}

TEST(ContentBudgetTest, MapsThatGrowAtTheSameTimeDoNotExceedTheLimit) {
  constexpr int64_t kLimit = 10'000;
  const auto budget = std::make_shared<ContentBudget>(kLimit);
  std::atomic<int> refused = 0;
  std::vector<std::thread> maps;
  std::vector<std::unique_ptr<ContentBudget::Share>> shares;
  for (int map = 0; map < 4; ++map) {
    shares.push_back(std::make_unique<ContentBudget::Share>(budget, 0));
    maps.emplace_back([share = shares.back().get(), &refused] {
      for (int i = 0; i < 1000; ++i) refused += !share->Grow(7).ok();
    });
  }
  for (std::thread& map : maps) map.join();
  EXPECT_EQ(budget->bytes(), kLimit / 7 * 7);
  EXPECT_EQ(refused, 4 * 1000 - kLimit / 7);
}

}  // namespace
}  // namespace hypermap::admission
