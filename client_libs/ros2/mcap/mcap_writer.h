// Writes MCAP files (https://mcap.dev/spec), version 0.
//
//   HYPERMAP_ASSIGN_OR_RETURN(McapWriter writer, McapWriter::Begin("ros2", "me", append_to_file));
//   HYPERMAP_ASSIGN_OR_RETURN(const auto schema, writer.AddSchema({"std_msgs/msg/Empty", ...}));
//   HYPERMAP_ASSIGN_OR_RETURN(const auto channel, writer.AddChannel({schema, "/bell", "cdr"}));
//   HYPERMAP_RETURN_IF_ERROR(writer.Write(channel, time, bytes));
//   HYPERMAP_RETURN_IF_ERROR(writer.Finish());
//
// Messages are in chunks without compression, each with its CRC and followed by an index of its
// messages. The summary at the end has all schemas and channels, the statistics and the index of
// the chunks, so that a reader can seek. Memory: the messages of the chunk that is being filled,
// and some 100 bytes for each chunk before.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_MCAP_MCAP_WRITER_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_MCAP_MCAP_WRITER_H_

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace hypermap::ros2 {

using McapMap = std::map<std::string, std::string>;

// How the messages of channels are to be read.
struct McapSchema {
  std::string name;
  std::string encoding;
  std::string text;
};

struct McapChannel {
  uint16_t schema = 0;  // as AddSchema returned it
  std::string topic;
  std::string message_encoding;
  McapMap metadata = {};
};

// Used by one thread. After an error it must not be used any more. Errors are those of the sink,
// besides the ones that a function names.
class McapWriter {
 public:
  // Appends bytes to the file.
  using Sink = std::function<absl::Status(absl::string_view bytes)>;

  // Writes the beginning of a file of the `profile`, made by `library`. A chunk is complete when it
  // has `chunk_bytes`; a larger message is alone in its chunk.
  static absl::StatusOr<McapWriter> Begin(const std::string& profile, const std::string& library,
                                          Sink sink, size_t chunk_bytes = 1 << 20);

  // Return the id. RESOURCE_EXHAUSTED if there are 65,535 already.
  absl::StatusOr<uint16_t> AddSchema(const McapSchema& schema);
  absl::StatusOr<uint16_t> AddChannel(const McapChannel& channel);

  // Appends a message that was logged and published at `time`. REQUIRES: `channel` was returned by
  // AddChannel. INVALID_ARGUMENT for a time before 1970 or after 2262.
  absl::Status Write(uint16_t channel, absl::Time time, absl::string_view message);

  absl::Status AddMetadata(const std::string& name, const McapMap& metadata);

  // Writes the last chunk and the summary. Must be called once, at the end.
  absl::Status Finish();

 private:
  // The times of some messages, in nanoseconds since 1970; both are 0 if there are none.
  struct TimeRange {
    uint64_t first = 0;
    uint64_t last = 0;

    void Add(uint64_t time, bool is_first);
  };
  // Where a message is in its chunk.
  struct MessageEntry {
    uint64_t time = 0;
    uint64_t offset = 0;
  };
  struct ChunkEntry {
    TimeRange times;
    uint64_t begin = 0;
    uint64_t bytes = 0;                            // of its record
    std::map<uint16_t, uint64_t> message_indexes;  // their places, by channel
    uint64_t message_index_bytes = 0;
    uint64_t record_bytes = 0;  // of the messages' records in it
  };
  struct MetadataEntry {
    std::string name;
    uint64_t begin = 0;
    uint64_t bytes = 0;
  };

  McapWriter(Sink sink, size_t chunk_bytes) : sink_(std::move(sink)), chunk_bytes_(chunk_bytes) {}
  absl::Status Append(absl::string_view bytes);
  absl::Status AppendRecord(uint8_t opcode, absl::string_view content);
  absl::Status EndChunk();
  absl::Status AppendMessageIndexes(ChunkEntry* chunk);
  absl::Status AppendSummary();
  // Appends records of one kind to the summary, and describes the group in `offsets`.
  absl::Status AppendGroup(uint8_t opcode, const std::vector<std::string>& contents,
                           std::vector<std::string>* offsets);
  std::string StatisticsContent() const;
  static std::string ChunkIndexContent(const ChunkEntry& chunk);

  Sink sink_;
  size_t chunk_bytes_;

  uint64_t position_ = 0;  // bytes of the file so far
  uint32_t crc_ = 0;       // of these bytes; from the summary on, of the summary

  // The chunk that is being filled.
  std::string chunk_;
  TimeRange chunk_times_;
  std::map<uint16_t, std::vector<MessageEntry>> chunk_messages_;  // by channel

  std::vector<std::string> schemas_;   // the contents of the records; ids are from 1 on
  std::vector<std::string> channels_;  // the contents of the records; ids are from 1 on
  std::vector<ChunkEntry> chunks_;
  std::vector<MetadataEntry> metadata_;
  TimeRange times_;
  std::map<uint16_t, uint64_t> message_counts_;  // by channel
};

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_MCAP_MCAP_WRITER_H_
