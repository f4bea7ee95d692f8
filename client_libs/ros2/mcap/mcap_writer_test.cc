#include "client_libs/ros2/mcap/mcap_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client_libs/ros2/mcap/testing/mcap_file.h"

namespace hypermap::ros2 {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr absl::Time At(int64_t seconds) { return absl::FromUnixSeconds(seconds); }

uint32_t Crc(absl::string_view bytes) {
  return crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
}

// A file that is written with chunks of 100 bytes.
class McapWriterTest : public testing::Test {
 protected:
  McapWriterTest() {
    auto begun = McapWriter::Begin(
        "ros2", "test",
        [this](absl::string_view bytes) {
          absl::StrAppend(&file_, bytes);
          return error_;
        },
        /*chunk_bytes=*/100);
    EXPECT_TRUE(begun.ok()) << begun.status();
    writer_.emplace(*std::move(begun));
  }

  uint16_t Channel(const std::string& topic) {
    const auto schema = writer_->AddSchema({"std_msgs/msg/String", "ros2msg", "string data"});
    EXPECT_TRUE(schema.ok()) << schema.status();
    const auto channel = writer_->AddChannel({*schema, topic, "cdr", {{"key", "value"}}});
    EXPECT_TRUE(channel.ok()) << channel.status();
    return *channel;
  }
  void Write(uint16_t channel, int64_t seconds, const std::string& message) {
    EXPECT_TRUE(writer_->Write(channel, At(seconds), message).ok());
  }
  std::vector<McapRecord> Finish() {
    EXPECT_TRUE(writer_->Finish().ok());
    return RecordsOf(file_);
  }
  static std::vector<McapRecord> Of(uint8_t opcode, const std::vector<McapRecord>& records) {
    std::vector<McapRecord> found;
    for (const McapRecord& record : records) {
      if (record.opcode == opcode) found.push_back(record);
    }
    return found;
  }

  std::string file_;
  absl::Status error_;
  std::optional<McapWriter> writer_;
};

TEST_F(McapWriterTest, AnEmptyFileIsTheSameToTheByte) {
  Finish();
  EXPECT_EQ(absl::BytesToHexString(file_),
            "894d434150300d0a"  // magic
            "011000000000000000"
            "04000000"
            "726f7332"
            "04000000"
            "74657374"  // header
            "0f0400000000000000" +
                absl::BytesToHexString(
                    absl::string_view(file_).substr(42, 4)) +  // end of the data, and its CRC
                "0b2e00000000000000" +
                std::string(2 * 46, '0') +  // statistics
                "0e1100000000000000"
                "0b"
                "2e00000000000000"
                "3700000000000000"  // offset of these
                "021400000000000000"
                "2e00000000000000"
                "6500000000000000" +
                absl::BytesToHexString(absl::string_view(file_).substr(file_.size() - 12, 4)) +
                "894d434150300d0a");
}

TEST_F(McapWriterTest, MessagesAreReadAsTheyWereWritten) {
  const uint16_t first = Channel("/first");
  Write(first, 7, "one");
  const uint16_t second = Channel("/second");
  Write(second, 7, std::string(500, 'x'));
  Write(first, 8, "");
  Finish();
  constexpr uint64_t kSecond = 1'000'000'000;
  EXPECT_THAT(MessagesOf(file_),
              ElementsAre(McapMessage{"/first", 7 * kSecond, "one"},
                          McapMessage{"/second", 7 * kSecond, std::string(500, 'x')},
                          McapMessage{"/first", 8 * kSecond, ""}));
}

TEST_F(McapWriterTest, ALargeMessageIsAloneInItsChunk) {
  const uint16_t channel = Channel("/a");
  Write(channel, 1, "small");
  Write(channel, 2, std::string(500, 'x'));
  Write(channel, 3, "small");
  Write(channel, 4, "small");
  const auto chunks = Of(0x06, Finish());
  ASSERT_EQ(chunks.size(), 3);
  EXPECT_EQ(RecordsIn(RecordsOfChunk(chunks[0]), 0).size(), 1);
  EXPECT_EQ(RecordsIn(RecordsOfChunk(chunks[1]), 0).size(), 1);
  EXPECT_EQ(RecordsIn(RecordsOfChunk(chunks[2]), 0).size(), 2);
}

TEST_F(McapWriterTest, CrcsAreThoseOfTheBytes) {
  const uint16_t channel = Channel("/a");
  Write(channel, 1, "message");
  const auto records = Finish();
  const McapRecord chunk = Of(0x06, records).at(0);
  McapFields fields(chunk.content.substr(3 * 8));
  EXPECT_EQ(fields.Number<uint32_t>(), Crc(RecordsOfChunk(chunk)));
  const McapRecord end = Of(0x0F, records).at(0);
  EXPECT_EQ(McapFields(end.content).Number<uint32_t>(),
            Crc(absl::string_view(file_).substr(0, end.begin)));
  McapFields footer(records.back().content);
  const auto summary = footer.Number<uint64_t>();
  footer.Number<uint64_t>();
  const uint64_t footer_end = records.back().begin + records.back().bytes - sizeof(uint32_t);
  EXPECT_EQ(footer.Number<uint32_t>(),
            Crc(absl::string_view(file_).substr(summary, footer_end - summary)));
}

TEST_F(McapWriterTest, IndexesLeadToTheMessages) {
  const uint16_t channel = Channel("/a");
  const uint16_t other = Channel("/b");
  Write(channel, 3, "first");
  Write(other, 4, "second");
  Write(channel, 5, std::string(90, 'x'));
  const auto records = Finish();
  const auto chunks = Of(0x06, records);
  const auto indexes = Of(0x08, records);
  ASSERT_EQ(indexes.size(), 2);
  McapFields index(indexes[0].content);
  EXPECT_EQ(index.Number<uint64_t>(), absl::ToUnixNanos(At(3)));
  EXPECT_EQ(index.Number<uint64_t>(), absl::ToUnixNanos(At(4)));
  EXPECT_EQ(index.Number<uint64_t>(), chunks[0].begin);
  EXPECT_EQ(index.Number<uint64_t>(), chunks[0].bytes);
  const std::string by_channel = index.Text();
  McapFields offsets(by_channel);
  ASSERT_EQ(offsets.Number<uint16_t>(), channel);
  const auto of_channel = offsets.Number<uint64_t>();
  ASSERT_EQ(offsets.Number<uint16_t>(), other);
  const auto of_other = offsets.Number<uint64_t>();
  const auto message_indexes = Of(0x07, records);
  EXPECT_EQ(message_indexes[0].begin, of_channel);
  EXPECT_EQ(message_indexes[1].begin, of_other);
  EXPECT_EQ(index.Number<uint64_t>(), message_indexes[0].bytes + message_indexes[1].bytes);
  // The place of the second message in its chunk.
  McapFields messages(message_indexes[1].content);
  EXPECT_EQ(messages.Number<uint16_t>(), other);
  const std::string entry = messages.Text();
  McapFields place(entry);
  EXPECT_EQ(place.Number<uint64_t>(), absl::ToUnixNanos(At(4)));
  const auto logged = RecordsIn(RecordsOfChunk(chunks[0]), 0);
  EXPECT_EQ(place.Number<uint64_t>(), logged.at(1).begin);
}

TEST_F(McapWriterTest, TheSummaryCountsAndTellsWhereItsPartsAre) {
  const uint16_t channel = Channel("/a");
  EXPECT_TRUE(writer_->AddMetadata("rosbag2", {{"a", "b"}}).ok());
  Write(channel, 3, "first");
  Write(channel, 4, "second");
  const auto records = Finish();
  McapFields statistics(Of(0x0B, records).at(0).content);
  EXPECT_EQ(statistics.Number<uint64_t>(), 2);  // messages
  EXPECT_EQ(statistics.Number<uint16_t>(), 1);  // schemas
  EXPECT_EQ(statistics.Number<uint32_t>(), 1);  // channels
  EXPECT_EQ(statistics.Number<uint32_t>(), 0);  // attachments
  EXPECT_EQ(statistics.Number<uint32_t>(), 1);  // metadata
  EXPECT_EQ(statistics.Number<uint32_t>(), 1);  // chunks
  EXPECT_EQ(statistics.Number<uint64_t>(), absl::ToUnixNanos(At(3)));
  EXPECT_EQ(statistics.Number<uint64_t>(), absl::ToUnixNanos(At(4)));
  std::vector<int> groups;
  for (const McapRecord& offset : Of(0x0E, records)) {
    McapFields fields(offset.content);
    const auto opcode = fields.Number<uint8_t>();
    const auto begin = fields.Number<uint64_t>();
    const auto bytes = fields.Number<uint64_t>();
    groups.push_back(opcode);
    for (const McapRecord& record :
         RecordsIn(absl::string_view(file_).substr(begin, bytes), begin)) {
      EXPECT_EQ(record.opcode, opcode);
    }
  }
  EXPECT_THAT(groups, ElementsAre(0x03, 0x04, 0x0B, 0x08, 0x0D));
}

TEST_F(McapWriterTest, RefusesWhatTheFormatCantHold) {
  const uint16_t channel = Channel("/a");
  EXPECT_TRUE(absl::IsInvalidArgument(writer_->Write(channel, At(-1), "")));
  EXPECT_TRUE(absl::IsInvalidArgument(writer_->Write(channel, absl::InfiniteFuture(), "")));
  for (int i = 1; i < 65535; ++i) ASSERT_TRUE(writer_->AddSchema({"a", "b", "c"}).ok());
  const auto one_more = writer_->AddSchema({"a", "b", "c"});
  EXPECT_TRUE(absl::IsResourceExhausted(one_more.status()));
  EXPECT_THAT(one_more.status().message(), HasSubstr("65535"));
}

TEST_F(McapWriterTest, ErrorsOfTheSinkEndIt) {
  const uint16_t channel = Channel("/a");
  error_ = absl::ResourceExhaustedError("the disk is full");
  EXPECT_TRUE(writer_->Write(channel, At(1), "buffered").ok());
  EXPECT_EQ(writer_->Write(channel, At(1), std::string(100, 'x')), error_);
}

}  // namespace
}  // namespace hypermap::ros2
