#include "client_libs/ros2/recording/bag_writer.h"

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

// The numbers of rmw/types.h. Names of policies are understood since Jazzy only, numbers by all
// distributions, if the file says that it is of a version before 9 (kVersion below).
std::string ProfilesOf(RecordedQos qos) {
  constexpr int kTransientLocal = 1;
  constexpr int kVolatile = 2;
  const bool is_latched = qos == RecordedQos::kLatched;
  const auto forever = [](absl::string_view name) {
    return absl::StrCat("  ", name, ":\n    sec: 9223372036\n    nsec: 854775807\n");
  };
  return absl::StrCat(
      "- history: 1\n  depth: ", is_latched ? 1 : 100,
      "\n  reliability: 1\n  durability: ", is_latched ? kTransientLocal : kVolatile, "\n",
      forever("deadline"), forever("lifespan"), "  liveliness: 1\n",
      forever("liveliness_lease_duration"), "  avoid_ros_namespace_conventions: false");
}

// rosbag2's own description of a file. A player takes the version from it, and all else from the
// summary of the file.
constexpr char kVersion[] =
    "version: 4\n"
    "storage_identifier: mcap\n"
    "relative_file_paths: []\n"
    "duration:\n"
    "  nanoseconds: 0\n"
    "starting_time:\n"
    "  nanoseconds_since_epoch: 0\n"
    "message_count: 0\n"
    "topics_with_message_count: []\n"
    "compression_format: \"\"\n"
    "compression_mode: \"\"\n";

}  // namespace

absl::StatusOr<BagWriter> BagWriter::Begin(McapWriter::Sink sink) {
  HYPERMAP_ASSIGN_OR_RETURN(McapWriter writer,
                            McapWriter::Begin("ros2", "hypermap", std::move(sink)));
  HYPERMAP_RETURN_IF_ERROR(writer.AddMetadata("rosbag2", {{"serialized_metadata", kVersion}}));
  return BagWriter(std::move(writer));
}

absl::StatusOr<uint16_t> BagWriter::SchemaOf(const std::string& type) {
  const auto known = schemas_.find(type);
  if (known != schemas_.end()) return known->second;
  HYPERMAP_ASSIGN_OR_RETURN(const std::string definition, FullDefinition(type));
  HYPERMAP_ASSIGN_OR_RETURN(const uint16_t id, writer_.AddSchema({type, "ros2msg", definition}));
  schemas_.emplace(type, id);
  return id;
}

absl::StatusOr<uint16_t> BagWriter::ChannelOf(const std::string& topic, const std::string& type,
                                              RecordedQos qos) {
  const auto known = channels_.find(topic);
  if (known != channels_.end()) return known->second;
  HYPERMAP_ASSIGN_OR_RETURN(const uint16_t schema, SchemaOf(type));
  HYPERMAP_ASSIGN_OR_RETURN(
      const uint16_t id,
      writer_.AddChannel({schema, topic, "cdr", {{"offered_qos_profiles", ProfilesOf(qos)}}}));
  channels_.emplace(topic, id);
  return id;
}

}  // namespace hypermap::ros2
