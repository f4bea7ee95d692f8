#include "client_libs/ros2/mcap/mcap_writer.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "absl/strings/str_cat.h"
#include "base/status/status_macros.h"

namespace hypermap::ros2 {
namespace {

constexpr absl::string_view kMagic = "\x89MCAP0\r\n";

enum Opcode : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

constexpr absl::string_view kNoCompression = "";
constexpr uint64_t kRecordHeaderBytes = 1 + sizeof(uint64_t);

// The fields of a record, all little-endian.
class Fields {
 public:
  template <typename T>
  Fields& Number(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));  // All machines of the project are little-endian.
    bytes_.append(raw, sizeof(T));
    return *this;
  }
  Fields& Text(absl::string_view text) {
    Number(static_cast<uint32_t>(text.size()));
    return Raw(text);
  }
  Fields& Raw(absl::string_view bytes) {
    bytes_.append(bytes.data(), bytes.size());
    return *this;
  }
  // Sequences and maps: the number of bytes, then the items, which `append` adds to other fields.
  template <typename Items, typename AppendItem>
  Fields& Each(const Items& items, AppendItem append) {
    Fields all;
    for (const auto& item : items) append(item, &all);
    return Text(all.bytes_);
  }
  Fields& Map(const McapMap& map) {
    return Each(map,
                [](const auto& entry, Fields* all) { all->Text(entry.first).Text(entry.second); });
  }
  Fields& Map(const std::map<uint16_t, uint64_t>& map) {
    return Each(
        map, [](const auto& entry, Fields* all) { all->Number(entry.first).Number(entry.second); });
  }

  std::string Take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

std::string RecordHeader(uint8_t opcode, uint64_t content_bytes) {
  return Fields().Number(opcode).Number(content_bytes).Take();
}

uint32_t Crc(uint32_t before, absl::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

// The id of a further schema or channel.
absl::StatusOr<uint16_t> NextId(const std::vector<std::string>& records, absl::string_view what) {
  if (records.size() < std::numeric_limits<uint16_t>::max()) {
    return static_cast<uint16_t>(records.size() + 1);
  }
  return absl::ResourceExhaustedError(absl::StrCat("an MCAP file has no more than 65535 ", what));
}

}  // namespace

void McapWriter::TimeRange::Add(uint64_t time, bool is_first) {
  first = is_first ? time : std::min(first, time);
  last = is_first ? time : std::max(last, time);
}

absl::StatusOr<McapWriter> McapWriter::Begin(const std::string& profile, const std::string& library,
                                             Sink sink, size_t chunk_bytes) {
  McapWriter writer(std::move(sink), chunk_bytes);
  HYPERMAP_RETURN_IF_ERROR(writer.Append(kMagic));
  HYPERMAP_RETURN_IF_ERROR(
      writer.AppendRecord(kHeader, Fields().Text(profile).Text(library).Take()));
  return writer;
}

absl::Status McapWriter::Append(absl::string_view bytes) {
  crc_ = Crc(crc_, bytes);
  position_ += bytes.size();
  return sink_(bytes);
}

absl::Status McapWriter::AppendRecord(uint8_t opcode, absl::string_view content) {
  HYPERMAP_RETURN_IF_ERROR(Append(RecordHeader(opcode, content.size())));
  return Append(content);
}

absl::StatusOr<uint16_t> McapWriter::AddSchema(const McapSchema& schema) {
  HYPERMAP_ASSIGN_OR_RETURN(const uint16_t id, NextId(schemas_, "schemas"));
  schemas_.push_back(
      Fields().Number(id).Text(schema.name).Text(schema.encoding).Text(schema.text).Take());
  HYPERMAP_RETURN_IF_ERROR(AppendRecord(kSchema, schemas_.back()));
  return id;
}

absl::StatusOr<uint16_t> McapWriter::AddChannel(const McapChannel& channel) {
  HYPERMAP_ASSIGN_OR_RETURN(const uint16_t id, NextId(channels_, "channels"));
  channels_.push_back(Fields()
                          .Number(id)
                          .Number(channel.schema)
                          .Text(channel.topic)
                          .Text(channel.message_encoding)
                          .Map(channel.metadata)
                          .Take());
  HYPERMAP_RETURN_IF_ERROR(AppendRecord(kChannel, channels_.back()));
  return id;
}

absl::Status McapWriter::Write(uint16_t channel, absl::Time time, absl::string_view message) {
  if (time < absl::UnixEpoch() || time > absl::FromUnixNanos(std::numeric_limits<int64_t>::max())) {
    return absl::InvalidArgumentError(
        absl::StrCat("the time ", absl::FormatTime(time), " can't be written to an MCAP file"));
  }
  const uint64_t nanoseconds = absl::ToUnixNanos(time);
  constexpr uint32_t kNoSequence = 0;
  const std::string fields = Fields()
                                 .Number(channel)
                                 .Number(kNoSequence)
                                 .Number(nanoseconds)  // logged
                                 .Number(nanoseconds)  // published
                                 .Take();
  const uint64_t content_bytes = fields.size() + message.size();
  if (chunk_.size() + kRecordHeaderBytes + content_bytes > chunk_bytes_) {
    HYPERMAP_RETURN_IF_ERROR(EndChunk());
  }
  chunk_times_.Add(nanoseconds, chunk_.empty());
  times_.Add(nanoseconds, message_counts_.empty());
  chunk_messages_[channel].push_back({nanoseconds, chunk_.size()});
  ++message_counts_[channel];
  absl::StrAppend(&chunk_, RecordHeader(kMessage, content_bytes), fields, message);
  return absl::OkStatus();
}

absl::Status McapWriter::EndChunk() {
  if (chunk_.empty()) return absl::OkStatus();
  const std::string fields = Fields()
                                 .Number(chunk_times_.first)
                                 .Number(chunk_times_.last)
                                 .Number(uint64_t{chunk_.size()})
                                 .Number(Crc(0, chunk_))
                                 .Text(kNoCompression)
                                 .Number(uint64_t{chunk_.size()})
                                 .Take();
  ChunkEntry chunk;
  chunk.times = chunk_times_;
  chunk.begin = position_;
  chunk.record_bytes = chunk_.size();
  HYPERMAP_RETURN_IF_ERROR(Append(RecordHeader(kChunk, fields.size() + chunk_.size())));
  HYPERMAP_RETURN_IF_ERROR(Append(fields));
  HYPERMAP_RETURN_IF_ERROR(Append(chunk_));
  chunk.bytes = position_ - chunk.begin;
  HYPERMAP_RETURN_IF_ERROR(AppendMessageIndexes(&chunk));
  chunks_.push_back(std::move(chunk));
  // A large message does not leave its memory behind.
  chunk_ = std::string();
  chunk_messages_.clear();
  return absl::OkStatus();
}

absl::Status McapWriter::AppendMessageIndexes(ChunkEntry* chunk) {
  const uint64_t begin = position_;
  for (const auto& [channel, messages] : chunk_messages_) {
    chunk->message_indexes[channel] = position_;
    const std::string content =
        Fields()
            .Number(channel)
            .Each(messages, [](const MessageEntry& message,
                               Fields* all) { all->Number(message.time).Number(message.offset); })
            .Take();
    HYPERMAP_RETURN_IF_ERROR(AppendRecord(kMessageIndex, content));
  }
  chunk->message_index_bytes = position_ - begin;
  return absl::OkStatus();
}

absl::Status McapWriter::AddMetadata(const std::string& name, const McapMap& metadata) {
  const uint64_t begin = position_;
  HYPERMAP_RETURN_IF_ERROR(AppendRecord(kMetadata, Fields().Text(name).Map(metadata).Take()));
  metadata_.push_back({name, begin, position_ - begin});
  return absl::OkStatus();
}

absl::Status McapWriter::Finish() {
  HYPERMAP_RETURN_IF_ERROR(EndChunk());
  HYPERMAP_RETURN_IF_ERROR(AppendRecord(kDataEnd, Fields().Number(crc_).Take()));
  HYPERMAP_RETURN_IF_ERROR(AppendSummary());
  return Append(kMagic);
}

absl::Status McapWriter::AppendSummary() {
  const uint64_t begin = position_;
  crc_ = 0;
  std::vector<std::string> chunk_indexes;
  for (const ChunkEntry& chunk : chunks_) chunk_indexes.push_back(ChunkIndexContent(chunk));
  std::vector<std::string> metadata_indexes;
  for (const MetadataEntry& entry : metadata_) {
    metadata_indexes.push_back(
        Fields().Number(entry.begin).Number(entry.bytes).Text(entry.name).Take());
  }
  std::vector<std::string> offsets;
  HYPERMAP_RETURN_IF_ERROR(AppendGroup(kSchema, schemas_, &offsets));
  HYPERMAP_RETURN_IF_ERROR(AppendGroup(kChannel, channels_, &offsets));
  HYPERMAP_RETURN_IF_ERROR(AppendGroup(kStatistics, {StatisticsContent()}, &offsets));
  HYPERMAP_RETURN_IF_ERROR(AppendGroup(kChunkIndex, chunk_indexes, &offsets));
  HYPERMAP_RETURN_IF_ERROR(AppendGroup(kMetadataIndex, metadata_indexes, &offsets));
  const uint64_t offsets_begin = position_;
  for (const std::string& offset : offsets) {
    HYPERMAP_RETURN_IF_ERROR(AppendRecord(kSummaryOffset, offset));
  }
  // The CRC of the summary includes the footer up to the CRC.
  constexpr uint64_t kFooterBytes = 2 * sizeof(uint64_t) + sizeof(uint32_t);
  HYPERMAP_RETURN_IF_ERROR(Append(RecordHeader(kFooter, kFooterBytes)));
  HYPERMAP_RETURN_IF_ERROR(Append(Fields().Number(begin).Number(offsets_begin).Take()));
  return Append(Fields().Number(crc_).Take());
}

absl::Status McapWriter::AppendGroup(uint8_t opcode, const std::vector<std::string>& contents,
                                     std::vector<std::string>* offsets) {
  if (contents.empty()) return absl::OkStatus();
  const uint64_t begin = position_;
  for (const std::string& content : contents) {
    HYPERMAP_RETURN_IF_ERROR(AppendRecord(opcode, content));
  }
  offsets->push_back(Fields().Number(opcode).Number(begin).Number(position_ - begin).Take());
  return absl::OkStatus();
}

std::string McapWriter::StatisticsContent() const {
  constexpr uint32_t kNoAttachments = 0;
  uint64_t messages = 0;
  for (const auto& [channel, count] : message_counts_) messages += count;
  return Fields()
      .Number(messages)
      .Number(static_cast<uint16_t>(schemas_.size()))
      .Number(static_cast<uint32_t>(channels_.size()))
      .Number(kNoAttachments)
      .Number(static_cast<uint32_t>(metadata_.size()))
      .Number(static_cast<uint32_t>(chunks_.size()))
      .Number(times_.first)
      .Number(times_.last)
      .Map(message_counts_)
      .Take();
}

std::string McapWriter::ChunkIndexContent(const ChunkEntry& chunk) {
  return Fields()
      .Number(chunk.times.first)
      .Number(chunk.times.last)
      .Number(chunk.begin)
      .Number(chunk.bytes)
      .Map(chunk.message_indexes)
      .Number(chunk.message_index_bytes)
      .Text(kNoCompression)
      .Number(chunk.record_bytes)  // compressed
      .Number(chunk.record_bytes)
      .Take();
}

}  // namespace hypermap::ros2
