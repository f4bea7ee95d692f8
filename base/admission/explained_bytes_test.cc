#include "base/admission/explained_bytes.h"

#include <gtest/gtest.h>

#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace hypermap::admission {
namespace {

using Call = ExplainedBytes::Call;

TEST(ExplainedBytesTest, SumsOfOneConnectionAreTakenOnce) {
  ExplainedBytes explained;
  std::optional<Call> call(std::in_place, &explained, "ipv4:127.0.0.1:1");
  EXPECT_EQ(call->host(), "127.0.0.1");
  call->Explain(100);
  Call(&explained, "ipv6:%5B::1%5D:2").Explain(7);
  Call(&explained, "ipv6:[::1]:2").Explain(8);
  auto taken = explained.Take();
  EXPECT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken["127.0.0.1:1"].bytes, ExplainedBytes::kHeaderBytes + 100);
  EXPECT_EQ(taken["127.0.0.1:1"].calls, 1);
  EXPECT_EQ(taken["[::1]:2"].bytes, 2 * ExplainedBytes::kHeaderBytes + 15);
  EXPECT_EQ(taken["[::1]:2"].calls, 0);
  EXPECT_TRUE(explained.Take().empty());
  call.reset();
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
      for (int k = 0; k < kCalls; ++k) {
        Call(&explained, absl::StrCat("ipv4:127.0.0.1:", k % 9)).Explain(1);
      }
    });
  }
  Explained sum;
  const auto take = [&] {
    for (const auto& [peer, part] : explained.Take()) {
      sum.bytes += part.bytes;
      sum.calls += part.calls;
    }
  };
  for (int i = 0; i < 100; ++i) take();
  for (std::thread& thread : threads) thread.join();
  take();
  EXPECT_EQ(sum.bytes, int64_t{kThreads} * kCalls * (ExplainedBytes::kHeaderBytes + 1));
  EXPECT_EQ(sum.calls, 0);
}

}  // namespace
}  // namespace hypermap::admission
