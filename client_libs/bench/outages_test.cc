#include "client_libs/bench/outages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "absl/time/time.h"

namespace hypermap::bench {
namespace {

class OutageLogTest : public testing::Test {
 protected:
  SteadyTime At(double seconds) const { return start_ + absl::Seconds(seconds); }

  const SteadyTime start_ = SteadyTime::Now();
};

TEST_F(OutageLogTest, WithoutFailuresThereIsNoOutage) {
  OutageLog log(2);
  log.Answered(0, At(1));
  log.Answered(1, At(2));
  EXPECT_THAT(log.outages(), testing::IsEmpty());
}

TEST_F(OutageLogTest, RestartEndsWhenTheLastClientIsBack) {
  OutageLog log(3);
  for (int client = 0; client < 3; ++client) log.Answered(client, At(10));
  for (int client = 0; client < 3; ++client) log.Failed(client, At(11 + 0.1 * client));
  log.Failed(0, At(12));
  log.Answered(2, At(14));
  log.Answered(0, At(15));
  log.Answered(2, At(15.5));
  ASSERT_EQ(log.outages().size(), 1U);
  EXPECT_EQ(log.outages()[0].AllBack(), std::nullopt);
  EXPECT_EQ(log.outages()[0].num_waiting, 1);
  log.Answered(1, At(17));

  const Outage outage = log.outages()[0];
  EXPECT_EQ(outage.last_answer_before, At(10));
  EXPECT_EQ(outage.first_failure, At(11));
  EXPECT_EQ(outage.first_answer_after, At(14));
  EXPECT_EQ(outage.Down(), absl::Seconds(4));
  EXPECT_EQ(outage.AllBack(), absl::Seconds(3));
  EXPECT_EQ(outage.num_failed, 3);
  EXPECT_EQ(outage.num_waiting, 0);
}

TEST_F(OutageLogTest, AnswersThatWereOnTheirWayAreNoReturn) {
  OutageLog log(2);
  log.Failed(0, At(1));
  log.Answered(1, At(1.1));
  EXPECT_EQ(log.outages()[0].first_answer_after, std::nullopt);
  log.Failed(1, At(1.2));
  log.Answered(1, At(3));
  log.Answered(0, At(4));
  EXPECT_EQ(log.outages()[0].first_answer_after, At(3));
  EXPECT_EQ(log.outages()[0].all_back, At(4));
}

TEST_F(OutageLogTest, ClientThatNoticedNothingIsBackWithItsNextAnswer) {
  OutageLog log(2);
  log.Failed(0, At(1));
  log.Answered(0, At(2));
  EXPECT_EQ(log.outages()[0].all_back, std::nullopt);
  log.Answered(1, At(5));
  EXPECT_EQ(log.outages()[0].all_back, At(5));
  EXPECT_EQ(log.outages()[0].num_failed, 1);
}

TEST_F(OutageLogTest, ClientThatFailsAgainIsNotBack) {
  OutageLog log(2);
  log.Failed(0, At(1));
  log.Failed(1, At(1));
  log.Answered(0, At(2));
  log.Failed(0, At(2.5));
  log.Answered(1, At(3));
  EXPECT_EQ(log.outages()[0].all_back, std::nullopt);
  log.Answered(0, At(4));
  EXPECT_EQ(log.outages()[0].all_back, At(4));
  EXPECT_EQ(log.outages()[0].num_failed, 2);
}

TEST_F(OutageLogTest, EachRestartIsAnOutage) {
  OutageLog log(1);
  log.Answered(0, At(0.5));
  log.Failed(0, At(1));
  log.Answered(0, At(2));
  log.Answered(0, At(3));
  log.Failed(0, At(4));
  log.Answered(0, At(6));
  ASSERT_EQ(log.outages().size(), 2U);
  EXPECT_EQ(log.outages()[0].Down(), absl::Seconds(1.5));
  EXPECT_EQ(log.outages()[1].last_answer_before, At(3));
  EXPECT_EQ(log.outages()[1].all_back, At(6));
}

TEST_F(OutageLogTest, ClientsOfManyThreadsAreAllCounted) {
  OutageLog log(8);
  std::vector<std::thread> threads;
  for (int client = 0; client < 8; ++client) {
    threads.emplace_back([&log, client] {
      for (int i = 0; i < 200; ++i) {
        log.Answered(client, SteadyTime::Now());
        if (i % 20 == client) log.Failed(client, SteadyTime::Now());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int client = 0; client < 8; ++client) log.Answered(client, SteadyTime::Now());
  for (int client = 0; client < 8; ++client) log.Answered(client, SteadyTime::Now());
  for (const Outage& outage : log.outages()) {
    EXPECT_TRUE(outage.all_back.has_value());
    EXPECT_EQ(outage.num_waiting, 0);
  }
}

}  // namespace
}  // namespace hypermap::bench
