#include "client_libs/ros2/dds/dds.h"

#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <sstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/dds/node.h"
#include "client_libs/ros2/dds/service_server.h"
#include "client_libs/ros2/dds/task_loop.h"

namespace hypermap::ros2 {
namespace {

using ::eprosima::fastdds::dds::PublicationMatchedStatus;
using ::eprosima::fastdds::dds::SampleInfo;
using ::eprosima::fastrtps::types::ReturnCode_t;

constexpr int kDepth = 10;

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

class NodeSubscription : public Subscription, private DataReaderListener {
 public:
  NodeSubscription(Node* node, MessageHandler handler)
      : node_(node), handler_(std::move(handler)) {}
  ~NodeSubscription() override {
    if (reader_ != nullptr) node_->Remove(reader_);
  }

  absl::Status Open(const std::string& name, const std::string& type, TopicQos qos) {
    HYPERMAP_ASSIGN_OR_RETURN(reader_, node_->AddReader(TopicOf(name), type, qos, kDepth, this));
    return absl::OkStatus();
  }

 private:
  void on_data_available(DataReader* reader) override {
    std::string message;
    SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) handler_(message);
    }
  }

  Node* const node_;
  const MessageHandler handler_;
  DataReader* reader_ = nullptr;
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
    return publisher;
  }

  absl::StatusOr<std::unique_ptr<Service>> Serve(const std::string& name, const std::string& type,
                                                 std::string empty,
                                                 ServiceHandler handler) override {
    return ServiceServer::Make(node_.get(), &loop_, name, type, std::move(empty),
                               std::move(handler));
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
