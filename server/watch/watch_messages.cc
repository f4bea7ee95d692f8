#include "server/watch/watch_messages.h"

#include <cstdint>
#include <string>

#include "google/protobuf/io/coded_stream.h"
#include "google/protobuf/io/zero_copy_stream_impl_lite.h"
#include "wire/time.h"

namespace hypermap::server {
namespace {

// Tag of a length-delimited field: its number and wire type 2 (protobuf encoding, "Message
// Structure"). Written by hand, because the inner messages are encoded already.
constexpr uint32_t kCoalescedTag = v1::WatchResponse::kCoalescedFieldNumber << 3 | 2;
// Upper bound of the bytes of a tag and a length: two 32-bit varints.
constexpr size_t kMaxHeadBytes = 10;

}  // namespace

v1::WatchResponse MessageOf(const FeedCommit& commit) {
  v1::WatchResponse message;
  message.set_revision(commit.revision);
  wire::EncodeTime(commit.time, message.mutable_time());
  message.set_author(commit.author);
  return message;
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
