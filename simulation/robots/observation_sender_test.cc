#include "simulation/robots/observation_sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/time/clock.h"
#include "simulation/robots/testing/robot_site.h"

namespace hypermap::robots {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

// Number of observations that are sent before the first acknowledgement is awaited.
constexpr int kAhead = 8;

class ObservationSenderTest : public ::testing::Test {
 protected:
  ObservationSenderTest() { site_.Edit(CreateLayer{{.name = "things"}}); }

  ObservationSender NewSender(
      const std::string& robot = "cart",
      std::function<bool()> is_interrupted = [] { return false; },
      absl::Duration patience = absl::Seconds(60)) {
    ObservationSender::Target target{"site", "things", {}};
    target.options.robot = robot;
    return {client_, target, patience, std::move(is_interrupted)};
  }

  // Returns an observation with the next sequence n and a stamp n seconds after the beginning.
  Observation See(const ObservationSender& sender, const std::string& robot = "cart") {
    Observation observation;
    observation.robot = robot;
    observation.sequence = sender.next_sequence();
    observation.stamp = begin_ + absl::Seconds(observation.sequence);
    Detection detection;
    detection.scores = {{"chair", 0.9}};
    detection.hull = Polygon::FromBox({{0, 0}, {1, 1}});
    observation.detections.push_back(detection);
    return observation;
  }
  void SendSome(ObservationSender& sender, int n) {
    for (int i = 0; i < n; ++i) ASSERT_EQ(sender.Send(See(sender)), absl::OkStatus());
  }

  std::vector<int64_t> Stored(const std::string& robot = "cart") {
    return site_.SequencesIn("things", robot);
  }

  RobotSite site_{{"."}, 1.0};
  client::Client client_ = site_.NewClient();
  const absl::Time begin_ = site_.Now() - absl::Minutes(5);
};

TEST_F(ObservationSenderTest, AllThatIsFlushedIsOnTheMapOnce) {
  ObservationSender sender = NewSender();
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  EXPECT_EQ(sender.next_sequence(), 0);
  SendSome(sender, 20);
  ASSERT_EQ(sender.Flush(), absl::OkStatus());
  EXPECT_EQ(sender.num_accepted(), 20);
  EXPECT_EQ(sender.next_sequence(), 20);
  const std::vector<int64_t> stored = Stored();
  ASSERT_THAT(stored, SizeIs(20));
  for (int64_t i = 0; i < 20; ++i) EXPECT_EQ(stored[static_cast<size_t>(i)], i);
  // Nothing is outstanding.
  EXPECT_EQ(sender.Flush(), absl::OkStatus());
  EXPECT_EQ(sender.num_accepted(), 20);
}

TEST_F(ObservationSenderTest, GoesOnCountingWhereTheRobotLeftOff) {
  {
    ObservationSender sender = NewSender();
    ASSERT_EQ(sender.Open(), absl::OkStatus());
    SendSome(sender, 3);
    ASSERT_EQ(sender.Flush(), absl::OkStatus());
  }
  ObservationSender again = NewSender();
  ASSERT_EQ(again.Open(), absl::OkStatus());
  EXPECT_EQ(again.next_sequence(), 3);
  SendSome(again, 1);
  ASSERT_EQ(again.Flush(), absl::OkStatus());
  EXPECT_EQ(again.num_accepted(), 1);
  EXPECT_THAT(Stored(), ElementsAre(0, 1, 2, 3));
  ObservationSender other = NewSender("barrow");
  ASSERT_EQ(other.Open(), absl::OkStatus());
  EXPECT_EQ(other.next_sequence(), 0) << "of another robot";
}

TEST_F(ObservationSenderTest, OpeningTellsWhatIsWrong) {
  ObservationSender::Target nowhere{"site", "nowhere", {}};
  EXPECT_TRUE(absl::IsNotFound(
      ObservationSender(client_, nowhere, absl::Seconds(60), [] { return false; }).Open()));
  site_.Stop();
  EXPECT_TRUE(absl::IsUnavailable(NewSender().Open()));
}

TEST_F(ObservationSenderTest, SendsAheadOfASlowDisk) {
  ObservationSender sender = NewSender();
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  site_.disk().Hold();
  SendSome(sender, kAhead);
  site_.disk().AwaitHeldWrite();
  EXPECT_EQ(sender.num_accepted(), 0);
  site_.disk().Release();
  ASSERT_EQ(sender.Flush(), absl::OkStatus());
  EXPECT_EQ(sender.num_accepted(), kAhead);
}

// The stream breaks at the first observation, which a sender that never reads acknowledgements
// would not notice.
TEST_F(ObservationSenderTest, WaitsForAcknowledgementsWhenItIsFarAhead) {
  ObservationSender sender = NewSender();
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  site_.disk().FailWrites(absl::DataLossError("the disk is broken"));
  SendSome(sender, kAhead);
  const absl::Status status = sender.Send(See(sender));
  EXPECT_TRUE(absl::IsDataLoss(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("the disk is broken"));
  EXPECT_EQ(sender.num_accepted(), 0);
}

TEST_F(ObservationSenderTest, WhatTheServerWillNotHaveIsTold) {
  ObservationSender sender = NewSender();
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  SendSome(sender, 1);
  // Once it is on the map, an earlier one is late and waits, also while the site's clock stands
  // still.
  ASSERT_EQ(sender.Flush(), absl::OkStatus());
  struct Case {
    std::string words;
    std::function<void(Observation&)> spoil;
  };
  const Case cases[] = {
      {"observation 1 of cart is refused_late",
       [](Observation& observation) { observation.stamp -= absl::Hours(1); }},
      {"observation 2 of cart is invalid: stamp",
       [](Observation& observation) { observation.stamp += absl::Hours(1); }},
      {"observation 3 of cart is invalid: detections[0]",
       [](Observation& observation) { observation.detections[0].weight = 2.0; }},
  };
  for (const Case& c : cases) {
    Observation observation = See(sender);
    c.spoil(observation);
    ASSERT_EQ(sender.Send(observation), absl::OkStatus());
    const absl::Status status = sender.Flush();
    EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(c.words));
  }
  // The stream continues, and a refusal is reported once.
  SendSome(sender, 1);
  ASSERT_EQ(sender.Flush(), absl::OkStatus());
  EXPECT_EQ(sender.num_accepted(), 2);
  EXPECT_THAT(Stored(), ElementsAre(0, 4));
}

TEST_F(ObservationSenderTest, TwoOfOneNameConflict) {
  ObservationSender one = NewSender(), two = NewSender();
  ASSERT_EQ(one.Open(), absl::OkStatus());
  ASSERT_EQ(two.Open(), absl::OkStatus());
  SendSome(one, 1);
  ASSERT_EQ(one.Flush(), absl::OkStatus());
  Observation other = See(two);
  other.detections.clear();
  ASSERT_EQ(two.Send(other), absl::OkStatus());
  const absl::Status status = two.Flush();
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr("observation 0 of cart is conflict"));
  EXPECT_EQ(two.num_accepted(), 0);
}

// The disk is blocked, so that the server stops before it has acknowledged anything. It is started
// again when the sender, while it waits for the server, asks whether it is interrupted.
TEST_F(ObservationSenderTest, AServerThatComesBackHasAllOnce) {
  std::jthread stopping;
  const absl::Cleanup release = [this] { site_.disk().Release(); };
  std::vector<int64_t> survived;
  ObservationSender sender = NewSender("cart", [&] {
    if (!stopping.joinable()) return false;
    site_.disk().Release();
    stopping.join();
    site_.Start();
    survived = Stored();
    return false;
  });
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  site_.disk().Hold();
  SendSome(sender, 5);
  site_.disk().AwaitHeldWrite();
  stopping = std::jthread([this] { site_.Stop(); });
  ASSERT_EQ(sender.Flush(), absl::OkStatus());
  EXPECT_THAT(survived, Not(IsEmpty())) << "what is sent again must be there already";
  EXPECT_EQ(sender.num_accepted(), 5);
  SendSome(sender, 1);
  ASSERT_EQ(sender.Flush(), absl::OkStatus());
  EXPECT_EQ(sender.num_accepted(), 6);
  EXPECT_THAT(Stored(), ElementsAre(0, 1, 2, 3, 4, 5));
}

TEST_F(ObservationSenderTest, WaitingForAServerCanBeInterrupted) {
  ObservationSender sender = NewSender("cart", [] { return true; });
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  site_.Stop();
  SendSome(sender, 1);
  EXPECT_EQ(sender.Flush(), absl::CancelledError("interrupted"));
}

TEST_F(ObservationSenderTest, PatienceHasAnEnd) {
  int asked = 0;
  ObservationSender sender = NewSender(
      "cart", [&] { return ++asked < 0; }, absl::ZeroDuration());
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  site_.Stop();
  SendSome(sender, 1);
  EXPECT_TRUE(absl::IsUnavailable(sender.Flush()));
  EXPECT_EQ(asked, 0);
  // Observations without acknowledgement are kept and sent at the next attempt.
  site_.Start();
  absl::Status status = sender.Flush();
  for (const absl::Time end = absl::Now() + absl::Seconds(60);
       absl::IsUnavailable(status) && absl::Now() < end; status = sender.Flush()) {
    absl::SleepFor(absl::Milliseconds(5));
  }
  ASSERT_EQ(status, absl::OkStatus());
  EXPECT_EQ(sender.num_accepted(), 1);
  EXPECT_THAT(Stored(), ElementsAre(0));
}

TEST_F(ObservationSenderTest, ALayerThatIsGoneWhenTheServerIsBackIsTold) {
  ObservationSender sender = NewSender("cart", [&] {
    site_.Start();
    site_.Edit(DeleteLayer{"things"});
    return false;
  });
  ASSERT_EQ(sender.Open(), absl::OkStatus());
  site_.Stop();
  SendSome(sender, 1);
  const absl::Status status = sender.Flush();
  EXPECT_TRUE(absl::IsNotFound(status)) << status;
}

}  // namespace
}  // namespace hypermap::robots
