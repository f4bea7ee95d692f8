#include "client_libs/ros2/dds/node.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/dds/raw_type.h"
#include "client_libs/ros2/messages/messages.h"

namespace hypermap::ros2 {
namespace {

namespace dds = ::eprosima::fastdds::dds;
using ::eprosima::fastdds::rtps::UDPv4TransportDescriptor;
using ::eprosima::fastrtps::c_TimeInfinite;
using ::eprosima::fastrtps::rtps::IPLocator;
using ::eprosima::fastrtps::rtps::Locator_t;

constexpr char kLoopback[] = "127.0.0.1";
// Participants of a machine that are looked for without multicast. RTPS gives each a port by its
// number (DDSI-RTPS 2.5, 9.6.1.1).
constexpr uint32_t kMaxParticipants = 120;

Locator_t LocatorOf(const std::string& address) {
  Locator_t locator;
  locator.kind = LOCATOR_KIND_UDPv4;
  IPLocator::setIPv4(locator, address);
  return locator;
}

// UDP alone: shared memory leaves files behind when a process is killed.
dds::DomainParticipantQos QosOf(const DdsOptions& options) {
  dds::DomainParticipantQos qos;
  qos.name(options.node_name);
  const std::string user_data = "enclave=/;";
  qos.user_data().data_vec(std::vector<uint8_t>(user_data.begin(), user_data.end()));
  auto udp = std::make_shared<UDPv4TransportDescriptor>();
  udp->maxInitialPeersRange = kMaxParticipants;
  // Large maps come in bursts of datagrams.
  udp->sendBufferSize = 4 << 20;
  udp->receiveBufferSize = 4 << 20;
  auto& builtin = qos.wire_protocol().builtin;
  if (options.localhost_only) {
    udp->interfaceWhiteList.push_back(kLoopback);
    builtin.initialPeersList.push_back(LocatorOf(kLoopback));
    builtin.metatrafficUnicastLocatorList.push_back(LocatorOf(kLoopback));
    qos.wire_protocol().default_unicast_locator_list.push_back(LocatorOf(kLoopback));
  }
  for (const std::string& peer : options.peers) {
    builtin.initialPeersList.push_back(LocatorOf(peer));
  }
  if (!options.localhost_only && !options.peers.empty()) {
    // A list of peers replaces multicast; this puts it back.
    builtin.initialPeersList.push_back(LocatorOf("239.255.0.1"));
  }
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(std::move(udp));
  // Often, so that nodes that start at any time find this one soon.
  auto& discovery = builtin.discovery_config;
  discovery.leaseDuration = {20, 0};
  discovery.leaseDuration_announcementperiod = {1, 0};
  discovery.initial_announcements.count = 10;
  discovery.initial_announcements.period = {0, 100'000'000};
  return qos;
}

// REQUIRES: `profile` is not kAsOffered, which is two readers.
template <typename Qos>
void SetTopicQos(TopicQos profile, int depth, Qos* qos) {
  qos->durability().kind = profile == TopicQos::kLatched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS
                                                         : dds::VOLATILE_DURABILITY_QOS;
  qos->reliability().kind = profile == TopicQos::kBestEffort ? dds::BEST_EFFORT_RELIABILITY_QOS
                                                             : dds::RELIABLE_RELIABILITY_QOS;
  qos->history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos->history().depth = depth;
  qos->resource_limits().allocated_samples = 1;
  qos->endpoint().history_memory_policy = eprosima::fastrtps::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
}

dds::DataWriterQos WriterQosOf(TopicQos profile, int depth) {
  dds::DataWriterQos qos;
  SetTopicQos(profile, profile == TopicQos::kLatched ? 1 : depth, &qos);
  // On another thread: a message of more than a datagram needs this, and a subscriber that is slow
  // or has died does not hold up the others.
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  // A reader whose first sample is not number 1 waits for a heartbeat.
  qos.reliable_writer_qos().times.heartbeatPeriod = {0, 50'000'000};
  qos.reliability().max_blocking_time = {0, 200'000'000};
  return qos;
}

template <size_t n>
rmw_dds_common::Gid<n> GidOf(const GUID_t& guid) {
  static_assert(n >= 16);
  rmw_dds_common::Gid<n> gid;
  std::copy_n(guid.guidPrefix.value, 12, gid.data.begin());
  std::copy_n(guid.entityId.value, 4, gid.data.begin() + 12);
  return gid;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Node>> Node::Make(const DdsOptions& options) {
  std::unique_ptr<Node> node(new Node(options));
  HYPERMAP_RETURN_IF_ERROR(node->Open());
  return node;
}

absl::Status Node::Open() {
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(options_.domain,
                                                                                   QosOf(options_));
  if (participant_ == nullptr) {
    return absl::UnavailableError(absl::StrCat("DDS can't use domain ", options_.domain));
  }
  publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  if (publisher_ == nullptr || subscriber_ == nullptr) {
    return absl::UnavailableError("DDS makes no publisher or subscriber");
  }
  const MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(
      graph_, MakeWriter("ros_discovery_info", rmw_dds_common::ParticipantEntitiesInfo<16>::kType,
                         TopicQos::kLatched, 1, nullptr));
  TellGraph();
  return absl::OkStatus();
}

Node::~Node() {
  if (participant_ == nullptr) return;
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

absl::StatusOr<dds::Topic*> Node::UseTopic(const std::string& name, const std::string& type) {
  UsedTopic& used = topics_[name];
  if (used.topic == nullptr) {
    // Registering a type again does nothing.
    dds::TypeSupport(new RawType(type)).register_type(participant_);
    used.topic = participant_->create_topic(name, type, dds::TOPIC_QOS_DEFAULT);
  }
  if (used.topic == nullptr) {
    topics_.erase(name);
    return absl::UnavailableError(absl::StrCat("DDS makes no topic ", name));
  }
  ++used.num_users;
  return used.topic;
}

void Node::LeaveTopic(const std::string& name) {
  const auto it = topics_.find(name);
  if (it == topics_.end() || --it->second.num_users > 0) return;
  participant_->delete_topic(it->second.topic);
  topics_.erase(it);
}

absl::StatusOr<DataWriter*> Node::MakeWriter(const std::string& topic, const std::string& type,
                                             TopicQos qos, int depth,
                                             DataWriterListener* listener) {
  HYPERMAP_ASSIGN_OR_RETURN(dds::Topic* const used, UseTopic(topic, type));
  DataWriter* const writer = publisher_->create_datawriter(used, WriterQosOf(qos, depth), listener);
  if (writer != nullptr) return writer;
  LeaveTopic(topic);
  return absl::UnavailableError(absl::StrCat("DDS makes no writer of ", topic));
}

absl::StatusOr<DataWriter*> Node::AddWriter(const std::string& topic, const std::string& type,
                                            TopicQos qos, int depth, DataWriterListener* listener) {
  const MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(DataWriter* const writer,
                            MakeWriter(topic, type, qos, depth, listener));
  writers_.insert(writer);
  TellGraph();
  return writer;
}

absl::StatusOr<DataReader*> Node::AddReader(const std::string& topic, const std::string& type,
                                            TopicQos qos, int depth, DataReaderListener* listener) {
  const MutexLock lock(&mutex_);
  HYPERMAP_ASSIGN_OR_RETURN(dds::Topic* const used, UseTopic(topic, type));
  dds::DataReaderQos reader_qos;
  SetTopicQos(qos, depth, &reader_qos);
  DataReader* const reader = subscriber_->create_datareader(used, reader_qos, listener);
  if (reader == nullptr) {
    LeaveTopic(topic);
    return absl::UnavailableError(absl::StrCat("DDS makes no reader of ", topic));
  }
  readers_.insert(reader);
  TellGraph();
  return reader;
}

void Node::Remove(DataWriter* writer) {
  const MutexLock lock(&mutex_);
  const std::string topic = writer->get_topic()->get_name();
  writers_.erase(writer);
  publisher_->delete_datawriter(writer);
  LeaveTopic(topic);
  TellGraph();
}

void Node::Remove(DataReader* reader) {
  const MutexLock lock(&mutex_);
  const std::string topic = reader->get_topicdescription()->get_name();
  readers_.erase(reader);
  subscriber_->delete_datareader(reader);
  LeaveTopic(topic);
  TellGraph();
}

template <size_t n>
std::string Node::EncodeGraph() const {
  rmw_dds_common::NodeEntitiesInfo<n> node;
  node.node_namespace = options_.node_namespace;
  node.node_name = options_.node_name;
  for (const DataReader* reader : readers_) node.reader_gid_seq.push_back(GidOf<n>(reader->guid()));
  for (const DataWriter* writer : writers_) node.writer_gid_seq.push_back(GidOf<n>(writer->guid()));
  rmw_dds_common::ParticipantEntitiesInfo<n> info;
  info.gid = GidOf<n>(participant_->guid());
  info.node_entities_info_seq.push_back(std::move(node));
  return EncodeCdr(info);
}

void Node::TellGraph() {
  std::string message = options_.gid_bytes == 24 ? EncodeGraph<24>() : EncodeGraph<16>();
  graph_->write(&message);
}

}  // namespace hypermap::ros2
