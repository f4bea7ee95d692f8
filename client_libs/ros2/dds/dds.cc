#include "client_libs/ros2/dds/dds.h"

#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"
#include "base/sync/mutex.h"
#include "client_libs/ros2/dds/node.h"
#include "client_libs/ros2/dds/service_server.h"
#include "client_libs/ros2/dds/task_loop.h"

namespace hypermap::ros2 {
namespace {

using ::eprosima::fastdds::dds::PublicationMatchedStatus;
using ::eprosima::fastdds::dds::RELIABLE_RELIABILITY_QOS;
using ::eprosima::fastdds::dds::SampleInfo;
using ::eprosima::fastdds::dds::SubscriptionMatchedStatus;
using ::eprosima::fastrtps::types::ReturnCode_t;

constexpr int kDepth = 10;
// Of subscriptions, as those of tf2: messages of many publishers may come in a burst.
constexpr int kSubscriptionDepth = 100;

// "nav_msgs::msg::dds_::OccupancyGrid_" is nav_msgs/msg/OccupancyGrid to ROS.
std::string TypeInRos(absl::string_view type) {
  absl::ConsumeSuffix(&type, "_");
  return absl::StrReplaceAll(type, {{"::dds_::", "/"}, {"::", "/"}});
}

std::string TopicOf(const std::string& name) { return absl::StrCat("rt", name); }

class NodePublisher : public Publisher, private DataWriterListener {
 public:
  NodePublisher(Node* node, std::function<void(const Subscriber&)> changed)
      : node_(node), changed_(std::move(changed)) {}
  ~NodePublisher() override {
    if (writer_ != nullptr) node_->Remove(writer_);
  }

  absl::Status Open(const std::string& name, const std::string& type, TopicQos qos) {
    HYPERMAP_ASSIGN_OR_RETURN(writer_, node_->AddWriter(TopicOf(name), type, qos, kDepth, this));
    return absl::OkStatus();
  }

  bool Publish(std::string message) override { return writer_->write(&message); }

  int num_subscribers() const override {
    PublicationMatchedStatus status;
    writer_->get_publication_matched_status(status);
    return status.current_count;
  }

 private:
  void on_publication_matched(DataWriter* /*writer*/,
                              const PublicationMatchedStatus& status) override {
    if (!changed_ || status.current_count_change == 0) return;
    std::ostringstream guid;
    guid << iHandle2GUID(status.last_subscription_handle);
    changed_({guid.str(), status.current_count_change > 0, status.current_count});
  }

  Node* const node_;
  const std::function<void(const Subscriber&)> changed_;
  DataWriter* writer_ = nullptr;
};

// Has a second reader for kAsOffered: reliable readers are not matched with publishers that are
// best effort, and readers that are best effort are matched with all.
class NodeSubscription : public Subscription, private DataReaderListener {
 public:
  NodeSubscription(Node* node, MessageHandler handler)
      : node_(node), handler_(std::move(handler)) {}
  ~NodeSubscription() override {
    for (DataReader* const reader : readers_) node_->Remove(reader);
  }

  absl::Status Open(const std::string& name, const std::string& type, TopicQos qos) {
    if (qos != TopicQos::kAsOffered) return AddReader(name, type, qos);
    HYPERMAP_RETURN_IF_ERROR(AddReader(name, type, TopicQos::kReliable));
    return AddReader(name, type, TopicQos::kBestEffort);
  }

 private:
  absl::Status AddReader(const std::string& name, const std::string& type, TopicQos qos) {
    HYPERMAP_ASSIGN_OR_RETURN(DataReader* const reader,
                              node_->AddReader(TopicOf(name), type, qos, kSubscriptionDepth, this));
    readers_.push_back(reader);
    return absl::OkStatus();
  }

  void on_subscription_matched(DataReader* reader,
                               const SubscriptionMatchedStatus& status) override {
    if (!IsReliable(*reader)) return;
    const GUID_t writer = iHandle2GUID(status.last_publication_handle);
    const MutexLock lock(&mutex_);
    if (status.current_count_change > 0) {
      reliable_.insert(writer);
    } else if (status.current_count_change < 0) {
      reliable_.erase(writer);
    }
  }

  void on_data_available(DataReader* reader) override {
    std::string message;
    SampleInfo info;
    const MutexLock lock(&mutex_);
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      const GUID_t writer = iHandle2GUID(info.publication_handle);
      const bool is_own = writer.guidPrefix == reader->guid().guidPrefix;
      // The reliable reader has the message, or will have it.
      const bool is_twice = !IsReliable(*reader) && reliable_.contains(writer);
      if (info.valid_data && !is_own && !is_twice) handler_(message);
    }
  }

  static bool IsReliable(const DataReader& reader) {
    return reader.get_qos().reliability().kind == RELIABLE_RELIABILITY_QOS;
  }

  Node* const node_;
  const MessageHandler handler_;
  std::vector<DataReader*> readers_;
  Mutex mutex_;                                        // Held while a message is handled, too.
  std::set<GUID_t> reliable_ ABSL_GUARDED_BY(mutex_);  // Publishers of the reliable reader.
};

class NodeParticipant : public Participant {
 public:
  explicit NodeParticipant(std::unique_ptr<Node> node) : node_(std::move(node)) {}
  absl::Status Start() { return loop_.Start(); }

  absl::StatusOr<std::unique_ptr<Publisher>> Advertise(
      const std::string& name, const std::string& type, TopicQos qos,
      std::function<void(const Subscriber&)> changed) override {
    auto publisher = std::make_unique<NodePublisher>(node_.get(), std::move(changed));
    HYPERMAP_RETURN_IF_ERROR(publisher->Open(name, type, qos));
    logging::Log(logging::Level::kInfo, "a topic is offered",
                 {{"topic", name}, {"type", TypeInRos(type)}});
    return publisher;
  }

  absl::StatusOr<std::unique_ptr<Service>> Serve(const std::string& name, const std::string& type,
                                                 std::string empty,
                                                 ServiceHandler handler) override {
    HYPERMAP_ASSIGN_OR_RETURN(
        std::unique_ptr<Service> service,
        ServiceServer::Make(node_.get(), &loop_, name, type, std::move(empty), std::move(handler)));
    logging::Log(logging::Level::kInfo, "a service is offered",
                 {{"service", name}, {"type", TypeInRos(type)}});
    return service;
  }

  absl::StatusOr<std::unique_ptr<Subscription>> Subscribe(const std::string& name,
                                                          const std::string& type, TopicQos qos,
                                                          MessageHandler handler) override {
    auto subscription = std::make_unique<NodeSubscription>(node_.get(), std::move(handler));
    HYPERMAP_RETURN_IF_ERROR(subscription->Open(name, type, qos));
    return subscription;
  }

 private:
  const std::unique_ptr<Node> node_;
  TaskLoop loop_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<Participant>> Participant::Make(const DdsOptions& options) {
  // What goes wrong is told by the results of calls.
  eprosima::fastdds::dds::Log::ClearConsumers();
  HYPERMAP_ASSIGN_OR_RETURN(std::unique_ptr<Node> node, Node::Make(options));
  auto participant = std::make_unique<NodeParticipant>(std::move(node));
  HYPERMAP_RETURN_IF_ERROR(participant->Start());
  return participant;
}

}  // namespace hypermap::ros2
