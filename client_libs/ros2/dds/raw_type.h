// The type of all topics: bytes that are CDR already.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_DDS_RAW_TYPE_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_DDS_RAW_TYPE_H_

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <functional>
#include <string>

namespace hypermap::ros2 {

// A sample is a std::string: an encapsulation header and the message. Announces no type
// information, so that types match by their names, as those of rmw do.
class RawType : public eprosima::fastdds::dds::TopicDataType {
 public:
  explicit RawType(const std::string& name);

  bool serialize(void* sample, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override;
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* sample) override;
  std::function<uint32_t()> getSerializedSizeProvider(void* sample) override;
  void* createData() override;
  void deleteData(void* sample) override;
  bool getKey(void* sample, eprosima::fastrtps::rtps::InstanceHandle_t* key,
              bool force_md5) override;
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_DDS_RAW_TYPE_H_
