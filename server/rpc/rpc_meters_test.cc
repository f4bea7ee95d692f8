#include "server/rpc/rpc_meters.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace hypermap::server {
namespace {

TEST(RpcMetersTest, CountsByRpcCodeAndDuration) {
  RpcMeters meters;
  meters.Began(Rpc::kQueryPoint);
  meters.Began(Rpc::kQueryPoint);
  meters.Ended(Rpc::kQueryPoint, absl::NotFoundError("map"), absl::Milliseconds(3));
  const RpcMeters::Reading reading = meters.Read(Rpc::kQueryPoint);
  EXPECT_EQ(reading.began, 2);
  EXPECT_EQ(reading.ended[static_cast<size_t>(absl::StatusCode::kNotFound)], 1);
  EXPECT_EQ(reading.ended[0], 0);
  EXPECT_EQ(reading.durations[5], 1);  // 2.5 to 5 ms
  EXPECT_DOUBLE_EQ(reading.total_s, 0.003);
  EXPECT_EQ(meters.Read(Rpc::kWatch).began, 0);
}

TEST(RpcMetersTest, AClassHasItsUpperBound) {
  RpcMeters meters;
  meters.Ended(Rpc::kWatch, absl::OkStatus(), absl::Seconds(10));
  meters.Ended(Rpc::kWatch, absl::OkStatus(), absl::Hours(10));
  meters.Ended(Rpc::kWatch, absl::OkStatus(), absl::ZeroDuration());
  const RpcMeters::Reading reading = meters.Read(Rpc::kWatch);
  EXPECT_EQ(reading.durations.front(), 1);
  EXPECT_EQ(reading.durations[reading.durations.size() - 2], 1);
  EXPECT_EQ(reading.durations.back(), 1);
}

TEST(RpcMetersTest, CountsRefusalsByTheirReason) {
  RpcMeters meters;
  using access::Reason;
  meters.Ended(Rpc::kWatch, access::Refusal(Reason::kMap, "no"), absl::ZeroDuration());
  meters.Ended(Rpc::kWatch, access::Refusal(Reason::kExpiredToken, "no"), absl::ZeroDuration());
  meters.Ended(Rpc::kQueryPoint, access::Refusal(Reason::kMap, "no"), absl::ZeroDuration());
  meters.Ended(Rpc::kWatch, absl::NotFoundError("map"), absl::ZeroDuration());
  EXPECT_EQ(meters.refused(Reason::kMap), 2);
  EXPECT_EQ(meters.refused(Reason::kExpiredToken), 1);
  EXPECT_EQ(meters.refused(Reason::kRole), 0);
}

TEST(RpcMetersTest, LosesNothingOfManyThreads) {
  RpcMeters meters;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int j = 0; j < 10'000; ++j) {
        meters.Began(Rpc::kQueryPoint);
        meters.Ended(Rpc::kQueryPoint, absl::OkStatus(), absl::Microseconds(50));
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const RpcMeters::Reading reading = meters.Read(Rpc::kQueryPoint);
  EXPECT_EQ(reading.began, 40'000);
  EXPECT_EQ(reading.ended[0], 40'000);
  EXPECT_EQ(reading.durations.front(), 40'000);
}

}  // namespace
}  // namespace hypermap::server
