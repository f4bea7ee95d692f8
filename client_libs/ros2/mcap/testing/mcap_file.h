// Reads MCAP files in tests, record by record.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_MCAP_TESTING_MCAP_FILE_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_MCAP_TESTING_MCAP_FILE_H_

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace hypermap::ros2 {

inline constexpr absl::string_view kMcapMagic = "\x89MCAP0\r\n";

struct McapRecord {
  uint8_t opcode = 0;
  uint64_t begin = 0;  // in the file
  uint64_t bytes = 0;  // with its header
  absl::string_view content;
};

// Takes the fields of a record one after the other.
class McapFields {
 public:
  explicit McapFields(absl::string_view bytes) : left_(bytes) {}

  template <typename T>
  T Number() {
    T value{};
    if (left_.size() < sizeof(T)) {
      ADD_FAILURE() << "the record is too short";
      left_ = {};
      return value;
    }
    std::memcpy(&value, left_.data(), sizeof(T));
    left_.remove_prefix(sizeof(T));
    return value;
  }
  // Also the bytes of a sequence or map.
  std::string Text() {
    const auto size = Number<uint32_t>();
    const std::string text(left_.substr(0, size));
    left_.remove_prefix(text.size());
    return text;
  }
  absl::string_view rest() const { return left_; }

 private:
  absl::string_view left_;
};

// The records in `bytes`, which begin at `begin` of the file.
inline std::vector<McapRecord> RecordsIn(absl::string_view bytes, uint64_t begin) {
  constexpr uint64_t kHeaderBytes = 9;
  std::vector<McapRecord> records;
  while (!bytes.empty()) {
    McapFields header(bytes);
    McapRecord record;
    record.opcode = header.Number<uint8_t>();
    record.begin = begin;
    record.bytes = kHeaderBytes + header.Number<uint64_t>();
    record.content = bytes.substr(kHeaderBytes, record.bytes - kHeaderBytes);
    EXPECT_EQ(record.content.size(), record.bytes - kHeaderBytes);
    begin += record.bytes;
    bytes.remove_prefix(std::min<uint64_t>(record.bytes, bytes.size()));
    records.push_back(record);
  }
  return records;
}

// The records of a file, without those in chunks. `file` must outlive the result.
inline std::vector<McapRecord> RecordsOf(absl::string_view file) {
  EXPECT_EQ(file.substr(0, kMcapMagic.size()), kMcapMagic);
  EXPECT_EQ(file.substr(file.size() - kMcapMagic.size()), kMcapMagic);
  return RecordsIn(file.substr(kMcapMagic.size(), file.size() - 2 * kMcapMagic.size()),
                   kMcapMagic.size());
}

// The messages' records in a chunk.
inline absl::string_view RecordsOfChunk(const McapRecord& chunk) {
  constexpr size_t kFieldBytes = 3 * 8 + 4 + 4 + 8;  // without compression
  return chunk.content.substr(kFieldBytes);
}

struct McapMessage {
  std::string topic;
  uint64_t time = 0;  // nanoseconds
  std::string data;

  friend bool operator==(const McapMessage&, const McapMessage&) = default;
};

// The messages of a file in their order.
inline std::vector<McapMessage> MessagesOf(absl::string_view file) {
  std::map<uint16_t, std::string> topics;
  std::vector<McapMessage> messages;
  for (const McapRecord& record : RecordsOf(file)) {
    if (record.opcode == 0x04) {
      McapFields channel(record.content);
      const auto id = channel.Number<uint16_t>();
      channel.Number<uint16_t>();  // schema
      topics[id] = channel.Text();
    }
    if (record.opcode != 0x06) continue;
    for (const McapRecord& logged : RecordsIn(RecordsOfChunk(record), 0)) {
      McapFields fields(logged.content);
      const auto channel = fields.Number<uint16_t>();
      fields.Number<uint32_t>();  // sequence
      const auto time = fields.Number<uint64_t>();
      EXPECT_EQ(fields.Number<uint64_t>(), time);  // published
      messages.push_back({topics[channel], time, std::string(fields.rest())});
    }
  }
  return messages;
}

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_MCAP_TESTING_MCAP_FILE_H_
