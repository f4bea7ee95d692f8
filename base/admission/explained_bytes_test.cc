#include "base/admission/explained_bytes.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::admission {
namespace {

TEST(ExplainedBytesTest, SumsOfOneConnectionAreTakenOnce) {
  ExplainedBytes explained;
  explained.BeginCall("ipv4:127.0.0.1:1");
  explained.Explain("ipv4:127.0.0.1:1", 100);
  explained.Explain("ipv6:%5B::1%5D:2", 7);
  explained.Explain("ipv6:[::1]:2", 8);
  auto taken = explained.Take();
  EXPECT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken["127.0.0.1:1"].bytes, ExplainedBytes::kHeaderBytes + 100);
  EXPECT_EQ(taken["127.0.0.1:1"].calls, 1);
  EXPECT_EQ(taken["[::1]:2"].bytes, 15);
  explained.EndCall("ipv4:127.0.0.1:1");
  taken = explained.Take();
  EXPECT_EQ(taken["127.0.0.1:1"].bytes, 0);
  EXPECT_EQ(taken["127.0.0.1:1"].calls, -1);
  EXPECT_TRUE(explained.Take().empty());
}

TEST(ExplainedBytesTest, NothingIsLostBetweenThreads) {
  constexpr int kThreads = 4;
  constexpr int kCalls = 10'000;
  ExplainedBytes explained;
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < kCalls; ++k) explained.Explain(absl::StrCat("ipv4:127.0.0.1:", k % 9), 1);
    });
  }
  int64_t sum = 0;
  const auto take = [&] {
    for (const auto& [peer, part] : explained.Take()) sum += part.bytes;
  };
  for (int i = 0; i < 100; ++i) take();
  for (std::thread& thread : threads) thread.join();
  take();
  EXPECT_EQ(sum, int64_t{kThreads} * kCalls);
}

}  // namespace
}  // namespace hypermap::admission
