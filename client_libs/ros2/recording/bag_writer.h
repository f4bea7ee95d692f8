// Writes messages of ROS 2 to an MCAP file as rosbag2 does, for `ros2 bag play` and viewers.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_BAG_WRITER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_BAG_WRITER_H_

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client_libs/ros2/cdr/cdr.h"
#include "client_libs/ros2/mcap/mcap_writer.h"
#include "client_libs/ros2/messages/definitions.h"

namespace hypermap::ros2 {

// How a player is to offer a topic.
enum class RecordedQos {
  kLatched,   // reliable, transient local: who comes late gets the newest message
  kReliable,  // reliable, volatile
};

// Topics begin with their first message. Errors are those of McapWriter. Used by one thread.
class BagWriter {
 public:
  // Begins a file, whose bytes go to `sink`.
  static absl::StatusOr<BagWriter> Begin(McapWriter::Sink sink);

  // Appends a message. All messages of a topic have the same type.
  template <typename Message>
  absl::Status Write(const std::string& topic, RecordedQos qos, const Message& message,
                     absl::Time time) {
    auto channel = ChannelOf(topic, RosTypeName(Message::kType), qos);
    if (!channel.ok()) return channel.status();
    return writer_.Write(*channel, time, EncodeCdr(message));
  }

  // Must be called once, at the end.
  absl::Status Finish() { return writer_.Finish(); }

 private:
  explicit BagWriter(McapWriter writer) : writer_(std::move(writer)) {}
  absl::StatusOr<uint16_t> ChannelOf(const std::string& topic, const std::string& type,
                                     RecordedQos qos);
  absl::StatusOr<uint16_t> SchemaOf(const std::string& type);

  McapWriter writer_;
  std::map<std::string, uint16_t> schemas_;   // by type
  std::map<std::string, uint16_t> channels_;  // by topic
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_RECORDING_BAG_WRITER_H_
