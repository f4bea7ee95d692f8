#include "storage/generation_cache.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

namespace hypermap::storage {
namespace {

using Cache = GenerationCache<int, std::shared_ptr<int>>;

std::shared_ptr<int> Cached(int value) { return std::make_shared<int>(value); }

TEST(GenerationCacheTest, KeepsWhatWasUsedLast) {
  Cache cache(std::make_shared<CacheRoom>(100), /*max_bytes=*/4);
  for (int key = 0; key < 100; ++key) {
    cache.Insert(key, Cached(key), /*bytes=*/1);
    ASSERT_EQ(*cache.Find(key), key);
    ASSERT_NE(cache.Find(0), nullptr) << "used all the time, after " << key;
  }
  int num_cached = 0;
  for (int key = 0; key < 100; ++key) num_cached += cache.Find(key) != nullptr;
  EXPECT_LE(num_cached, 4);
}

TEST(GenerationCacheTest, B3KeepsFewHeavyEntries) {
  Cache cache(std::make_shared<CacheRoom>(10'000), /*max_bytes=*/64);
  std::vector<std::weak_ptr<int>> values;
  for (int key = 0; key < 100; ++key) {
    std::shared_ptr<int> value = Cached(key);
    values.push_back(value);
    cache.Insert(key, std::move(value), /*bytes=*/16);
  }
  int num_alive = 0;
  for (const auto& value : values) num_alive += !value.expired();
  EXPECT_EQ(num_alive, 4);
  EXPECT_EQ(*cache.Find(99), 99);
  // An entry that exceeds the limit alone is kept, with at most one generation besides.
  cache.Insert(100, Cached(100), /*bytes=*/1000);
  cache.Insert(101, Cached(101), /*bytes=*/1000);
  EXPECT_NE(cache.Find(101), nullptr);
  num_alive = 0;
  for (const auto& value : values) num_alive += !value.expired();
  EXPECT_EQ(num_alive, 0);
}

TEST(GenerationCacheTest, CachesShareTheirRoom) {
  const auto room = std::make_shared<CacheRoom>(100);
  auto first = std::make_unique<Cache>(room, /*max_bytes=*/80);
  Cache second(room, /*max_bytes=*/80);
  for (int key = 0; key < 100; ++key) first->Insert(key, Cached(key), /*bytes=*/10);
  EXPECT_NE(first->Find(99), nullptr);
  for (int key = 0; key < 100; ++key) second.Insert(key, Cached(key), /*bytes=*/30);
  EXPECT_EQ(second.Find(99), nullptr);
  EXPECT_NE(first->Find(99), nullptr);
  first.reset();
  second.Insert(100, Cached(100), /*bytes=*/30);
  EXPECT_NE(second.Find(100), nullptr);
  EXPECT_FALSE(room->Take(71));
  EXPECT_TRUE(room->Take(70));
}

}  // namespace
}  // namespace hypermap::storage
