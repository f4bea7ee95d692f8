#include "client_libs/ros2/dds/service_server.h"

#include <fastdds/rtps/common/WriteParams.h>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "base/logging/log.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

using ::eprosima::fastdds::dds::PublicationMatchedStatus;
using ::eprosima::fastdds::dds::SampleInfo;
using ::eprosima::fastrtps::types::ReturnCode_t;

constexpr int kCallsKept = 100;  // Of requests and replies that are kept.
constexpr size_t kEncapsulationBytes = 4;
constexpr size_t kCycloneBytes = 16;
// A request may come before its sender's reader of replies is known.
constexpr absl::Duration kPatience = absl::Seconds(5);
constexpr absl::Duration kBetweenLooks = absl::Milliseconds(5);
// Readers may lose the first sample that they get from a writer. So the first reply that a client
// gets is to nobody, and the next ones wait until it has had the time to arrive. It names a call of
// the server itself, because ros2-client takes a reply without a call for an error.
constexpr absl::Duration kAfterGreeting = absl::Milliseconds(150);

// The vendor is in the first two bytes of a GUID (DDSI-RTPS 2.5, 8.2.4.2).
bool IsCyclone(const GUID_t& guid) {
  return guid.guidPrefix.value[0] == 0x01 && guid.guidPrefix.value[1] == 0x10;
}

std::string WithoutCycloneHeader(absl::string_view payload) {
  return absl::StrCat(payload.substr(0, kEncapsulationBytes),
                      payload.substr(kEncapsulationBytes + kCycloneBytes));
}

std::string WithCycloneHeader(absl::string_view payload, absl::string_view header) {
  return absl::StrCat(payload.substr(0, kEncapsulationBytes), header,
                      payload.substr(kEncapsulationBytes));
}

}  // namespace

class ServiceServer::Core : public std::enable_shared_from_this<Core> {
 public:
  Core(TaskLoop* loop, std::string name, std::string empty, ServiceHandler handler)
      : loop_(loop),
        name_(std::move(name)),
        greeting_(WithCycloneHeader(empty, std::string(kCycloneBytes, '\0'))),
        handler_(std::move(handler)) {}

  void Open(DataWriter* replies) {
    const MutexLock lock(&mutex_);
    replies_ = replies;
  }
  void Close() { Open(nullptr); }

  void Take(Request request) {
    request.arrived = loop_->Now();
    AddTask(request.arrived, std::move(request));
  }

  void Matched(const GuidPrefix& client, int change) {
    const MutexLock lock(&clients_mutex_);
    if ((clients_[client].num_readers += change) <= 0) clients_.erase(client);
  }

 private:
  void AddTask(SteadyTime due, Request request) {
    loop_->Add(due, [self = shared_from_this(), request = std::move(request)]() mutable {
      self->Handle(std::move(request));
    });
  }

  // Answers the request, or asks for another call later.
  void Handle(Request request) {
    const MutexLock lock(&mutex_);
    if (replies_ == nullptr) return;
    const std::optional<SteadyTime> due = ReadyAt(request.from.guidPrefix);
    const SteadyTime now = loop_->Now();
    if (due && *due <= now) return Answer(request);
    if (now - request.arrived > kPatience) {
      return logging::Log(logging::Level::kWarning, "a ROS 2 client does not read replies",
                          {{"service", name_}});
    }
    AddTask(due.value_or(now + kBetweenLooks), std::move(request));
  }

  // When a client can get replies; nullopt while that is not known. Greets a new one.
  std::optional<SteadyTime> ReadyAt(const GuidPrefix& prefix)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    {
      const MutexLock lock(&clients_mutex_);
      const auto client = clients_.find(prefix);
      if (client == clients_.end()) return std::nullopt;
      if (client->second.greeted) return *client->second.greeted + kAfterGreeting;
      client->second.greeted = loop_->Now();
    }
    SampleIdentity call_of_nobody;
    call_of_nobody.writer_guid(replies_->guid());
    call_of_nobody.sequence_number({0, 1});
    Reply(greeting_, call_of_nobody);
    return loop_->Now() + kAfterGreeting;
  }

  void Answer(const Request& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const absl::string_view payload = request.payload;
    if (IsCyclone(request.from) && AnswerAfterHeader(request)) return;
    if (const std::optional<std::string> response = handler_(payload)) {
      return Reply(*response, request.reply_to);
    }
    if (AnswerAfterHeader(request)) return;
    logging::Log(logging::Level::kWarning, "a ROS 2 client sent a request that can't be read",
                 {{"service", name_}});
  }

  // Returns whether the payload is a request after the 16 bytes.
  bool AnswerAfterHeader(const Request& request) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const absl::string_view payload = request.payload;
    if (payload.size() < kEncapsulationBytes + kCycloneBytes) return false;
    const std::optional<std::string> response = handler_(WithoutCycloneHeader(payload));
    if (!response) return false;
    const absl::string_view header = payload.substr(kEncapsulationBytes, kCycloneBytes);
    Reply(WithCycloneHeader(*response, header), request.reply_to);
    return true;
  }

  void Reply(std::string message, const SampleIdentity& reply_to)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    eprosima::fastrtps::rtps::WriteParams params;
    params.related_sample_identity(reply_to);
    if (!replies_->write(&message, params)) {
      logging::Log(logging::Level::kWarning, "a reply to a ROS 2 client was not sent",
                   {{"service", name_}});
    }
  }

  TaskLoop* const loop_;
  const std::string name_;
  const std::string greeting_;
  Mutex mutex_;
  ServiceHandler handler_ ABSL_GUARDED_BY(mutex_);
  DataWriter* replies_ ABSL_GUARDED_BY(mutex_) = nullptr;  // Null after the end of the service.
  // Another mutex, because DDS tells of clients while others write. Not held while writing.
  Mutex clients_mutex_;
  std::map<GuidPrefix, Client> clients_ ABSL_GUARDED_BY(clients_mutex_);
};

class ServiceServer::Listener : public DataReaderListener, public DataWriterListener {
 public:
  explicit Listener(Core* core) : core_(core) {}

  void on_data_available(DataReader* reader) override {
    Request request;
    SampleInfo info;
    while (reader->take_next_sample(&request.payload, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      request.from = info.sample_identity.writer_guid();
      request.reply_to = info.sample_identity;
      // rmw_fastrtps names its reader of replies there.
      const GUID_t& reader_of_replies = info.related_sample_identity.writer_guid();
      if (reader_of_replies != GUID_t::unknown()) request.reply_to.writer_guid(reader_of_replies);
      core_->Take(std::move(request));
      request = {};
    }
  }

  void on_publication_matched(DataWriter* /*writer*/,
                              const PublicationMatchedStatus& status) override {
    const GUID_t guid = iHandle2GUID(status.last_subscription_handle);
    core_->Matched(guid.guidPrefix, status.current_count_change);
  }

 private:
  Core* const core_;
};

absl::StatusOr<std::unique_ptr<ServiceServer>> ServiceServer::Make(Node* node, TaskLoop* loop,
                                                                   const std::string& name,
                                                                   const std::string& type,
                                                                   std::string empty,
                                                                   ServiceHandler handler) {
  auto core = std::make_shared<Core>(loop, name, std::move(empty), std::move(handler));
  std::unique_ptr<ServiceServer> server(new ServiceServer(node, std::move(core)));
  HYPERMAP_ASSIGN_OR_RETURN(
      server->replies_,
      node->AddWriter(absl::StrCat("rr", name, "Reply"), absl::StrCat(type, "Response_"),
                      TopicQos::kReliable, kCallsKept, server->listener_.get()));
  server->core_->Open(server->replies_);
  HYPERMAP_ASSIGN_OR_RETURN(
      server->requests_,
      node->AddReader(absl::StrCat("rq", name, "Request"), absl::StrCat(type, "Request_"),
                      TopicQos::kReliable, kCallsKept, server->listener_.get()));
  return server;
}

ServiceServer::ServiceServer(Node* node, std::shared_ptr<Core> core)
    : node_(node), core_(std::move(core)), listener_(std::make_unique<Listener>(core_.get())) {}

ServiceServer::~ServiceServer() {
  if (requests_ != nullptr) node_->Remove(requests_);
  core_->Close();
  if (replies_ != nullptr) node_->Remove(replies_);
}

}  // namespace hypermap::ros2
