// Requests and replies over two topics, in both conventions of ROS 2. Only for the sources of this
// room.
//
//   rmw_fastrtps_cpp     a reply names its request in the RTPS field "related sample identity"
//   rmw_cyclonedds_cpp   requests and replies begin with 16 bytes, a client and a number
//
// A request is taken for one with the 16 bytes if it can't be decoded without them, or comes from
// Cyclone DDS and can be decoded with them. Its reply is in the same convention.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_DDS_SERVICE_SERVER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_DDS_SERVICE_SERVER_H_

#include <fastdds/rtps/common/SampleIdentity.h>

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "base/sync/mutex.h"
#include "base/sync/steady_time.h"
#include "client_libs/ros2/dds/dds.h"
#include "client_libs/ros2/dds/node.h"
#include "client_libs/ros2/dds/task_loop.h"

namespace hypermap::ros2 {

// Takes requests on the threads of DDS and answers them on the loop.
class ServiceServer : public Service {
 public:
  // See Participant::Serve. `node` and `loop` must outlive the result.
  static absl::StatusOr<std::unique_ptr<ServiceServer>> Make(Node* node, TaskLoop* loop,
                                                             const std::string& name,
                                                             const std::string& type,
                                                             std::string empty,
                                                             ServiceHandler handler);
  ~ServiceServer() override;

 private:
  using SampleIdentity = eprosima::fastrtps::rtps::SampleIdentity;
  using GuidPrefix = eprosima::fastrtps::rtps::GuidPrefix_t;

  struct Request {
    std::string payload;
    GUID_t from;
    SampleIdentity reply_to;
    SteadyTime arrived = SteadyTime::InfinitePast();
  };
  // A participant that reads replies.
  struct Client {
    int num_readers = 0;
    std::optional<SteadyTime> greeted;
  };

  // What tasks on the loop use, which may be left over when the service has ended.
  class Core;
  class Listener;

  ServiceServer(Node* node, std::shared_ptr<Core> core);

  Node* const node_;
  const std::shared_ptr<Core> core_;
  std::unique_ptr<Listener> listener_;
  DataReader* requests_ = nullptr;
  DataWriter* replies_ = nullptr;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_DDS_SERVICE_SERVER_H_
