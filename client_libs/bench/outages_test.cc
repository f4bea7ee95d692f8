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

  // Adds the clients with the numbers 0 to num_clients - 1.
  void AddClients(int num_clients) {
    for (int i = 0; i < num_clients; ++i) EXPECT_EQ(log_.AddClient(), i);
  }
  void Answer(int client, double seconds) { log_.Answered(client, At(seconds)); }
  void Fail(int client, double seconds) { log_.Failed(client, At(seconds)); }

  const SteadyTime start_ = SteadyTime::Now();
  OutageLog log_;
};

TEST_F(OutageLogTest, WithoutFailuresThereIsNoOutage) {
  AddClients(2);
  Answer(0, 1);
  Answer(1, 2);
  EXPECT_THAT(log_.outages(), testing::IsEmpty());
}

TEST_F(OutageLogTest, RestartEndsWhenTheLastClientIsBack) {
  AddClients(3);
  for (int client = 0; client < 3; ++client) Answer(client, 10);
  for (int client = 0; client < 3; ++client) Fail(client, 11 + 0.1 * client);
  Fail(0, 12);
  Answer(2, 14);
  Answer(0, 15);
  Answer(2, 15.5);
  ASSERT_EQ(log_.outages().size(), 1U);
  EXPECT_EQ(log_.outages()[0].AllBack(), std::nullopt);
  EXPECT_EQ(log_.outages()[0].num_waiting, 1);
  Answer(1, 17);

  const Outage outage = log_.outages()[0];
  EXPECT_EQ(outage.last_answer_before, At(10));
  EXPECT_EQ(outage.first_failure, At(11));
  EXPECT_EQ(outage.first_answer_after, At(14));
  EXPECT_EQ(outage.Down(), absl::Seconds(4));
  EXPECT_EQ(outage.AllBack(), absl::Seconds(3));
  EXPECT_EQ(outage.num_failed, 3);
  EXPECT_EQ(outage.num_waiting, 0);
}

TEST_F(OutageLogTest, AnswersThatWereOnTheirWayAreNoReturn) {
  AddClients(2);
  Fail(0, 1);
  Answer(1, 1.1);
  EXPECT_EQ(log_.outages()[0].first_answer_after, std::nullopt);
  Fail(1, 1.2);
  Answer(1, 3);
  Answer(0, 4);
  EXPECT_EQ(log_.outages()[0].first_answer_after, At(3));
  EXPECT_EQ(log_.outages()[0].all_back, At(4));
}

TEST_F(OutageLogTest, ClientThatNoticedNothingIsBackWithItsNextAnswer) {
  AddClients(2);
  Fail(0, 1);
  Answer(0, 2);
  EXPECT_EQ(log_.outages()[0].all_back, std::nullopt);
  Answer(1, 5);
  EXPECT_EQ(log_.outages()[0].all_back, At(5));
  EXPECT_EQ(log_.outages()[0].num_failed, 1);
}

TEST_F(OutageLogTest, ClientThatFailsAgainIsNotBack) {
  AddClients(2);
  Fail(0, 1);
  Fail(1, 1);
  Answer(0, 2);
  Fail(0, 2.5);
  Answer(1, 3);
  EXPECT_EQ(log_.outages()[0].all_back, std::nullopt);
  Answer(0, 4);
  EXPECT_EQ(log_.outages()[0].all_back, At(4));
  EXPECT_EQ(log_.outages()[0].num_failed, 2);
}

TEST_F(OutageLogTest, EachRestartIsAnOutage) {
  AddClients(1);
  Answer(0, 0.5);
  Fail(0, 1);
  Answer(0, 2);
  Answer(0, 3);
  Fail(0, 4);
  Answer(0, 6);
  ASSERT_EQ(log_.outages().size(), 2U);
  EXPECT_EQ(log_.outages()[0].Down(), absl::Seconds(1.5));
  EXPECT_EQ(log_.outages()[1].last_answer_before, At(3));
  EXPECT_EQ(log_.outages()[1].all_back, At(6));
}

TEST_F(OutageLogTest, ClientsOfManyThreadsAreAllCounted) {
  AddClients(8);
  std::vector<std::thread> threads;
  threads.reserve(8);
  for (int client = 0; client < 8; ++client) {
    threads.emplace_back([this, client] {
      for (int i = 0; i < 200; ++i) {
        log_.Answered(client, SteadyTime::Now());
        if (i % 20 == client) log_.Failed(client, SteadyTime::Now());
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (int client = 0; client < 8; ++client) log_.Answered(client, SteadyTime::Now());
  for (int client = 0; client < 8; ++client) log_.Answered(client, SteadyTime::Now());
  for (const Outage& outage : log_.outages()) {
    EXPECT_TRUE(outage.all_back.has_value());
    EXPECT_EQ(outage.num_waiting, 0);
  }
}

}  // namespace
}  // namespace hypermap::bench
