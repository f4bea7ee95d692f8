#include "client_libs/cpp/replica/published.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "base/sync/mutex.h"

namespace hypermap::client {
namespace {

// Counts its instances, and overwrites itself on destruction so that a late reader notices.
class Counted {
 public:
  Counted(int64_t number, std::atomic<int>* alive) : first_(number), last_(number), alive_(alive) {
    ++*alive_;
  }
  ~Counted() {
    first_ = -1;
    last_ = -2;
    --*alive_;
  }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

  int64_t number() const { return first_; }
  bool IsWhole() const { return first_ == last_ && first_ >= 0; }

 private:
  int64_t first_;
  int64_t last_;
  std::atomic<int>* alive_;
};

TEST(PublishedTest, IsNullBeforeTheFirst) {
  const Published<int> published;
  EXPECT_EQ(published.Read().get(), nullptr);
}

TEST(PublishedTest, GivesTheNewestAndKeepsNoOther) {
  std::atomic<int> alive = 0;
  {
    Published<Counted> published;
    for (int64_t i = 0; i < 10; ++i) {
      published.Set(std::make_unique<Counted>(i, &alive));
      EXPECT_EQ(published.Read()->number(), i);
      EXPECT_EQ(alive, 1);
    }
  }
  EXPECT_EQ(alive, 0);
}

TEST(PublishedTest, WhatIsReadStaysWhileOthersSeeTheNext) {
  std::atomic<int> alive = 0;
  Published<Counted> published;
  published.Set(std::make_unique<Counted>(1, &alive));
  std::thread writer;
  {
    const auto reading = published.Read();
    writer = std::thread([&] { published.Set(std::make_unique<Counted>(2, &alive)); });
    while (published.Read()->number() != 2) std::this_thread::yield();
    EXPECT_EQ(reading->number(), 1);
    EXPECT_TRUE(reading->IsWhole());
    EXPECT_EQ(alive, 2);
  }
  writer.join();
  EXPECT_EQ(alive, 1);
}

TEST(PublishedTest, ReadersOnSeveralThreadsSeeWholeValuesInOrder) {
  constexpr int64_t kValues = 2000;
  std::atomic<int> alive = 0;
  Published<Counted> published;
  published.Set(std::make_unique<Counted>(0, &alive));
  std::vector<std::thread> readers;
  std::atomic<int> faults = 0;
  for (int i = 0; i < 3; ++i) {
    readers.emplace_back([&] {
      for (int64_t last = 0; last < kValues;) {
        const auto reading = published.Read();
        if (!reading->IsWhole() || reading->number() < last) ++faults;
        last = reading->number();
      }
    });
  }
  std::thread writers[2];
  std::atomic<int64_t> next = 1;
  Mutex in_order;
  for (std::thread& writer : writers) {
    writer = std::thread([&] {
      for (;;) {
        const MutexLock lock(&in_order);
        if (next > kValues) return;
        published.Set(std::make_unique<Counted>(next++, &alive));
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(faults, 0);
  EXPECT_EQ(alive, 1);
}

}  // namespace
}  // namespace hypermap::client
