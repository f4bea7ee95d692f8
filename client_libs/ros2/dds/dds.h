// The wire protocol of ROS 2 (DDS-RTPS) as topics and services of encoded messages.
//
// The only room that knows Fast DDS. It follows what rmw_fastrtps_cpp and rmw_cyclonedds_cpp do, so
// that nodes of either find it: names begin with rt/, rq/ and rr/, and the topic ros_discovery_info
// tells which node has which topics.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_DDS_DDS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_DDS_DDS_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace hypermap::ros2 {

struct DdsOptions {
  int domain = 0;  // ROS_DOMAIN_ID
  // Of the node, as "ros2 node list" shows it: /NAMESPACE/NAME.
  std::string node_name = "hypermap";
  std::string node_namespace = "/";
  // True: talks to this machine only, over 127.0.0.1 and without multicast.
  bool localhost_only = false;
  // Addresses of other machines that multicast does not reach.
  std::vector<std::string> peers;
  // Bytes of a Gid in ros_discovery_info: 24 up to Humble, 16 since Iron.
  int gid_bytes = 16;
};

// Somebody who reads a topic, as text for logs.
struct Subscriber {
  std::string guid;
  bool joined = false;  // otherwise it has left
  int count = 0;        // of all subscribers, now
};

// A topic to which one writes. Thread safe. May not outlive its participant.
class Publisher {
 public:
  virtual ~Publisher() = default;
  // Sends a message in CDR. Returns whether it was taken; a latched one then replaces the one
  // before for those who come late.
  virtual bool Publish(std::string message) = 0;
  virtual int num_subscribers() const = 0;
};

// Answers one kind of request. `request` is a message in CDR, and so is the answer. nullopt: the
// bytes are no such request.
using ServiceHandler = std::function<std::optional<std::string>(absl::string_view request)>;

// A service that is served as long as this lives. May not outlive its participant.
class Service {
 public:
  virtual ~Service() = default;
};

// Handles the messages of a topic, in CDR, one after another.
using MessageHandler = std::function<void(absl::string_view message)>;

// A subscription, as long as this lives. May not outlive its participant.
class Subscription {
 public:
  virtual ~Subscription() = default;
};

// How the messages of a topic are kept and sent, as ROS 2's QoS profiles name it.
enum class TopicQos {
  kLatched,     // reliable, transient local, depth 1: who comes late gets the newest
  kReliable,    // reliable, volatile, depth 10
  kBestEffort,  // best effort, volatile, depth 10
  // For subscriptions: reliable with publishers that are, best effort with the others, volatile.
  kAsOffered,
};

// One node. Thread safe.
class Participant {
 public:
  // UNAVAILABLE if the network can't be used.
  static absl::StatusOr<std::unique_ptr<Participant>> Make(const DdsOptions& options);
  virtual ~Participant() = default;

  // `name` is a name of ROS such as "/map", `type` one of the wire (Message::kType). `changed` is
  // called on another thread when a subscriber has come or gone; it must not wait.
  virtual absl::StatusOr<std::unique_ptr<Publisher>> Advertise(
      const std::string& name, const std::string& type, TopicQos qos,
      std::function<void(const Subscriber&)> changed) = 0;

  // Serves `name`; `type` is that of the service (Service::kType). `empty` is a response without
  // content. The handlers of all services run on one thread.
  virtual absl::StatusOr<std::unique_ptr<Service>> Serve(const std::string& name,
                                                         const std::string& type, std::string empty,
                                                         ServiceHandler handler) = 0;

  // Messages of this node itself are left out.
  virtual absl::StatusOr<std::unique_ptr<Subscription>> Subscribe(const std::string& name,
                                                                  const std::string& type,
                                                                  TopicQos qos,
                                                                  MessageHandler handler) = 0;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_DDS_DDS_H_
