// A node of ROS 2 in Fast DDS: its topics, readers and writers, and what tells others of them. Only
// for the sources of this room.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_DDS_NODE_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_DDS_NODE_H_

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "client_libs/ros2/dds/dds.h"

namespace hypermap::ros2 {

using eprosima::fastdds::dds::DataReader;
using eprosima::fastdds::dds::DataReaderListener;
using eprosima::fastdds::dds::DataWriter;
using eprosima::fastdds::dds::DataWriterListener;
using eprosima::fastrtps::rtps::GUID_t;

// Thread safe. Readers and writers must be removed before it is destroyed.
class Node {
 public:
  static absl::StatusOr<std::unique_ptr<Node>> Make(const DdsOptions& options);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  // `topic` is a name of DDS, such as rt/map. `depth` is the number of samples that are kept. The
  // listener must live until the writer is removed. Others learn of it from ros_discovery_info.
  absl::StatusOr<DataWriter*> AddWriter(const std::string& topic, const std::string& type,
                                        TopicQos qos, int depth, DataWriterListener* listener);
  absl::StatusOr<DataReader*> AddReader(const std::string& topic, const std::string& type,
                                        TopicQos qos, int depth, DataReaderListener* listener);
  void Remove(DataWriter* writer);
  void Remove(DataReader* reader);

 private:
  explicit Node(const DdsOptions& options) : options_(options) {}
  absl::Status Open();
  absl::StatusOr<eprosima::fastdds::dds::Topic*> UseTopic(const std::string& name,
                                                          const std::string& type)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void LeaveTopic(const std::string& name) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::StatusOr<DataWriter*> MakeWriter(const std::string& topic, const std::string& type,
                                         TopicQos qos, int depth, DataWriterListener* listener)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  // Tells others which readers and writers the node has.
  void TellGraph() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  template <size_t n>
  std::string EncodeGraph() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  struct UsedTopic {
    eprosima::fastdds::dds::Topic* topic = nullptr;
    int num_users = 0;
  };

  const DdsOptions options_;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  eprosima::fastdds::dds::Publisher* publisher_ = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber_ = nullptr;
  Mutex mutex_;
  std::map<std::string, UsedTopic> topics_ ABSL_GUARDED_BY(mutex_);
  std::set<DataWriter*> writers_ ABSL_GUARDED_BY(mutex_);
  std::set<DataReader*> readers_ ABSL_GUARDED_BY(mutex_);
  DataWriter* graph_ ABSL_GUARDED_BY(mutex_) = nullptr;  // Writes ros_discovery_info.
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_DDS_NODE_H_
