#include "client_libs/ros2/dds/raw_type.h"

#include <cstring>

namespace hypermap::ros2 {

using ::eprosima::fastrtps::rtps::InstanceHandle_t;
using ::eprosima::fastrtps::rtps::SerializedPayload_t;

RawType::RawType(const std::string& name) {
  setName(name.c_str());
  // Of the first samples' memory, which grows when it must.
  m_typeSize = 1024;
  m_isGetKeyDefined = false;
  auto_fill_type_object(false);
  auto_fill_type_information(false);
}

bool RawType::serialize(void* sample, SerializedPayload_t* payload) {
  const auto& bytes = *static_cast<const std::string*>(sample);
  if (bytes.size() > payload->max_size) return false;
  std::memcpy(payload->data, bytes.data(), bytes.size());
  payload->length = static_cast<uint32_t>(bytes.size());
  payload->encapsulation = CDR_LE;
  return true;
}

bool RawType::deserialize(SerializedPayload_t* payload, void* sample) {
  static_cast<std::string*>(sample)->assign(reinterpret_cast<const char*>(payload->data),
                                            payload->length);
  return true;
}

std::function<uint32_t()> RawType::getSerializedSizeProvider(void* sample) {
  return
      [sample] { return static_cast<uint32_t>(static_cast<const std::string*>(sample)->size()); };
}

void* RawType::createData() { return new std::string(); }

void RawType::deleteData(void* sample) { delete static_cast<std::string*>(sample); }

bool RawType::getKey(void* /*sample*/, InstanceHandle_t* /*key*/, bool /*force_md5*/) {
  return false;
}

}  // namespace hypermap::ros2
