// The participant and clients that speak as rmw_fastrtps_cpp does. tests/ros2 has those of Cyclone
// DDS.
#include "client_libs/ros2/dds/dds.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/dds/testing/fast_client.h"
#include "client_libs/ros2/messages/messages.h"

// Debian's Fast DDS frees some objects by another size than it has allocated them with.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "new_delete_type_mismatch=0"; }

namespace hypermap::ros2 {
namespace {

using hypermap_msgs::GetSemanticByString;

constexpr absl::Duration kDeadline = absl::Seconds(60);

// Domains of their own for tests that run at the same time.
DdsOptions OptionsOf(const std::string& node) {
  DdsOptions options;
  options.domain = 100 + static_cast<int>(getpid() % 100);
  options.node_name = node;
  options.localhost_only = true;
  return options;
}

// What has arrived. Thread safe.
class Arrivals {
 public:
  void Add(std::string what) {
    const MutexLock lock(&mutex_);
    arrived_.insert(std::move(what));
    changed_.NotifyAll();
  }
  bool Has(const std::string& what) {
    const MutexLock lock(&mutex_);
    return arrived_.contains(what);
  }
  bool Await(const std::string& what) {
    const MutexLock lock(&mutex_);
    const SteadyTime deadline = SteadyTime::Now() + kDeadline;
    while (!arrived_.contains(what) && SteadyTime::Now() < deadline) {
      changed_.WaitFor(&mutex_, absl::Milliseconds(100));
    }
    return arrived_.contains(what);
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  std::set<std::string> arrived_ ABSL_GUARDED_BY(mutex_);
};

TEST(ParticipantTest, ClientsOfFastDdsGetTheRepliesToTheirRequests) {
  const auto participant = Participant::Make(OptionsOf("server"));
  ASSERT_TRUE(participant.ok()) << participant.status();
  const auto service =
      (*participant)
          ->Serve("/echo", GetSemanticByString::kType, EncodeCdr(GetSemanticByString::Response()),
                  [](absl::string_view payload) -> std::optional<std::string> {
                    const auto request = DecodeCdr<GetSemanticByString::Request>(payload);
                    if (!request.ok()) return std::nullopt;
                    GetSemanticByString::Response response;
                    response.objects.resize(1);
                    response.objects[0].name = request->name;
                    return EncodeCdr(response);
                  });
  ASSERT_TRUE(service.ok()) << service.status();
  for (int i = 0; i < 3; ++i) {
    FastClient client(OptionsOf("client"), "/echo", GetSemanticByString::kType);
    ASSERT_TRUE(client.AwaitService(kDeadline));
    for (int call = 0; call < 20; ++call) {
      const std::string name = absl::StrCat("call ", call);
      const auto reply = client.Call(EncodeCdr(GetSemanticByString::Request{name}), kDeadline);
      ASSERT_TRUE(reply.has_value()) << "client " << i << ", " << name;
      const auto response = DecodeCdr<GetSemanticByString::Response>(*reply);
      ASSERT_TRUE(response.ok() && response->objects.size() == 1);
      EXPECT_EQ(response->objects[0].name, name);
    }
    EXPECT_TRUE(client.all_replies_named_calls()) << "client " << i;
  }
}

TEST(ParticipantTest, WhoComesLateGetsTheNewestLatchedMessage) {
  const auto participant = Participant::Make(OptionsOf("server"));
  ASSERT_TRUE(participant.ok()) << participant.status();
  Arrivals changes;
  const auto publisher = (*participant)
                             ->Advertise("/time", "builtin_interfaces::msg::dds_::Time_",
                                         TopicQos::kLatched, [&](const Subscriber& subscriber) {
                                           changes.Add(subscriber.joined ? "joined" : "left");
                                         });
  ASSERT_TRUE(publisher.ok()) << publisher.status();
  for (int32_t sec = 1; sec <= 3; ++sec) {
    EXPECT_TRUE((*publisher)->Publish(EncodeCdr(builtin_interfaces::Time{sec, 0})));
  }
  {
    const auto late = Participant::Make(OptionsOf("late"));
    ASSERT_TRUE(late.ok()) << late.status();
    Arrivals times;
    const auto subscription = (*late)->Subscribe(
        "/time", "builtin_interfaces::msg::dds_::Time_", TopicQos::kLatched,
        [&](absl::string_view message) {
          times.Add(absl::StrCat(DecodeCdr<builtin_interfaces::Time>(message)->sec));
        });
    ASSERT_TRUE(subscription.ok()) << subscription.status();
    EXPECT_TRUE(times.Await("3"));
    EXPECT_TRUE(changes.Await("joined"));
  }
  EXPECT_TRUE(changes.Await("left"));
  EXPECT_EQ((*publisher)->num_subscribers(), 0);
}

TEST(ParticipantTest, ASubscriptionTakesReliableAndBestEffortPublishersButNotItsOwn) {
  constexpr char kType[] = "builtin_interfaces::msg::dds_::Time_";
  const auto reader = Participant::Make(OptionsOf("reader"));
  const auto writer = Participant::Make(OptionsOf("writer"));
  ASSERT_TRUE(reader.ok()) << reader.status();
  ASSERT_TRUE(writer.ok()) << writer.status();
  Arrivals arrivals;
  Mutex mutex;
  std::multiset<std::string> arrived;
  const auto subscription =
      (*reader)->Subscribe("/time", kType, TopicQos::kAsOffered, [&](absl::string_view message) {
        const auto time = DecodeCdr<builtin_interfaces::Time>(message);
        const MutexLock lock(&mutex);
        arrived.insert(absl::StrCat(time->sec, ".", time->nanosec));
        arrivals.Add(absl::StrCat(time->sec));
      });
  ASSERT_TRUE(subscription.ok()) << subscription.status();
  std::vector<std::unique_ptr<Publisher>> publishers;
  const auto advertise = [&](Participant& node, TopicQos qos) {
    Arrivals joined;
    auto publisher = node.Advertise("/time", kType, qos, [&joined](const Subscriber& subscriber) {
      joined.Add(absl::StrCat(subscriber.count));
    });
    ASSERT_TRUE(publisher.ok()) << publisher.status();
    // A reliable publisher is matched with both readers of the subscription.
    EXPECT_TRUE(joined.Await(qos == TopicQos::kReliable ? "2" : "1"));
    publishers.push_back(*std::move(publisher));
  };
  advertise(**reader, TopicQos::kReliable);
  advertise(**writer, TopicQos::kReliable);
  advertise(**writer, TopicQos::kBestEffort);
  // Readers may lose what a publisher sends before they know it.
  const SteadyTime deadline = SteadyTime::Now() + kDeadline;
  for (uint32_t n = 0; !(arrivals.Has("1") && arrivals.Has("2")); ++n) {
    ASSERT_LT(SteadyTime::Now(), deadline);
    for (int32_t i = 0; i < 3; ++i) {
      publishers[i]->Publish(EncodeCdr(builtin_interfaces::Time{i, n}));
    }
    absl::SleepFor(absl::Milliseconds(10));
  }
  EXPECT_FALSE(arrivals.Has("0"));
  const MutexLock lock(&mutex);
  for (const std::string& message : arrived) EXPECT_EQ(arrived.count(message), 1u) << message;
}

}  // namespace
}  // namespace hypermap::ros2
