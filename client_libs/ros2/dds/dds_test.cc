// The participant and clients that speak as rmw_fastrtps_cpp does. tests/ros2 has those of Cyclone
// DDS.
#include "client_libs/ros2/dds/dds.h"

#include <fastdds/rtps/common/WriteParams.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <set>
#include <string>

#include "absl/strings/str_cat.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/dds/node.h"
#include "client_libs/ros2/messages/messages.h"

// Debian's Fast DDS frees some objects by another size than it has allocated them with.
extern "C" const char* __asan_default_options();
extern "C" const char* __asan_default_options() { return "new_delete_type_mismatch=0"; }

namespace hypermap::ros2 {
namespace {

using ::eprosima::fastdds::dds::SampleInfo;
using ::eprosima::fastrtps::rtps::WriteParams;
using ::eprosima::fastrtps::types::ReturnCode_t;
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

// A client in the convention of rmw_fastrtps_cpp: requests name its reader of replies, and replies
// name their request.
class FastClient : private DataReaderListener {
 public:
  explicit FastClient(const std::string& service) : node_(*Node::Make(OptionsOf("client"))) {
    replies_ = *node_->AddReader(absl::StrCat("rr", service, "Reply"),
                                 absl::StrCat(GetSemanticByString::kType, "Response_"),
                                 TopicQos::kReliable, 10, this);
    requests_ = *node_->AddWriter(absl::StrCat("rq", service, "Request"),
                                  absl::StrCat(GetSemanticByString::kType, "Request_"),
                                  TopicQos::kReliable, 10, nullptr);
  }
  ~FastClient() override {
    node_->Remove(requests_);
    node_->Remove(replies_);
  }

  // Returns whether the call was answered with an object of that name.
  bool Call(const std::string& name) {
    std::string message = EncodeCdr(GetSemanticByString::Request{name});
    WriteParams params;
    params.related_sample_identity().writer_guid(replies_->guid());
    if (!requests_->write(&message, params)) return false;
    return replied_.Await(
        absl::StrCat(params.sample_identity().sequence_number().to64long(), " ", name));
  }

  void AwaitService() {
    const SteadyTime deadline = SteadyTime::Now() + kDeadline;
    eprosima::fastdds::dds::PublicationMatchedStatus status;
    while (SteadyTime::Now() < deadline) {
      requests_->get_publication_matched_status(status);
      if (status.current_count > 0) return;
      usleep(1000);
    }
  }

 private:
  void on_data_available(DataReader* reader) override {
    std::string message;
    SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      const bool is_ours = info.related_sample_identity.writer_guid() == replies_->guid();
      const auto reply = DecodeCdr<GetSemanticByString::Response>(message);
      if (!is_ours || !reply.ok() || reply->objects.size() != 1) continue;
      replied_.Add(absl::StrCat(info.related_sample_identity.sequence_number().to64long(), " ",
                                reply->objects[0].name));
    }
  }

  const std::unique_ptr<Node> node_;
  Arrivals replied_;
  DataReader* replies_ = nullptr;
  DataWriter* requests_ = nullptr;
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
    FastClient client("/echo");
    client.AwaitService();
    for (int call = 0; call < 20; ++call) {
      EXPECT_TRUE(client.Call(absl::StrCat("call ", call))) << "client " << i;
    }
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

}  // namespace
}  // namespace hypermap::ros2
