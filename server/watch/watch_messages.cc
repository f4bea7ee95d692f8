#include "server/watch/watch_messages.h"

#include <cstdint>
#include <string>

#include "base/limits/limits.h"
#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "wire/change.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

// Tag of a length-delimited field: its number and wire type 2 (protobuf encoding, "Message
// Structure"). Written by hand, because the inner messages are encoded already.
constexpr uint32_t kCoalescedTag = WatchMessage::kCoalescedFieldNumber << 3 | 2;
// Upper bound of the bytes of a tag and a length: two 32-bit varints.
constexpr size_t kMaxHeadBytes = 10;

int64_t ItemsOf(const MapChange& change) { return 1 + static_cast<int64_t>(change.cells.size()); }

}  // namespace

WatchMessage MessageOf(const FeedCommit& commit, uint64_t incarnation) {
  WatchMessage message;
  message.set_revision(commit.revision);
  wire::EncodeTime(commit.time, message.mutable_time());
  message.set_author(commit.author);
  message.set_incarnation(incarnation);
  return message;
}

void ChangeEncoder::Add(const MapChange& change) {
  v1::Change* const message = messages_->Add();
  wire::EncodeChange(change, message);
  items_ += ItemsOf(change);
  bytes_ += static_cast<int64_t>(message->ByteSizeLong());
}

size_t EncodeChanges(const std::vector<MapChange>& changes, size_t first, const Limits& limits,
                     google::protobuf::RepeatedPtrField<v1::Change>* messages) {
  ChangeEncoder encoder(limits, messages);
  size_t next = first;
  for (; next < changes.size() && !encoder.full(); ++next) encoder.Add(changes[next]);
  return next;
}

bool ExceedMessage(const std::vector<MapChange>& changes, const Limits& limits) {
  int64_t items = 0;
  for (size_t i = 0; i + 1 < changes.size() && items < limits.chunk_items; ++i) {
    items += ItemsOf(changes[i]);
  }
  return items >= limits.chunk_items;
}

grpc::Slice Coalesce(const std::vector<grpc::Slice>& messages) {
  if (messages.empty()) return {};
  if (messages.size() == 1) return messages.front();
  size_t size = 0;
  for (const grpc::Slice& message : messages) size += kMaxHeadBytes + message.size();
  std::string bytes;
  bytes.reserve(size);
  google::protobuf::io::StringOutputStream stream(&bytes);
  {
    google::protobuf::io::CodedOutputStream out(&stream);
    for (const grpc::Slice& message : messages) {
      out.WriteTag(kCoalescedTag);
      out.WriteVarint32(static_cast<uint32_t>(message.size()));
      out.WriteRaw(message.begin(), static_cast<int>(message.size()));
    }
  }
  return bytes;
}

}  // namespace hypermap::server
