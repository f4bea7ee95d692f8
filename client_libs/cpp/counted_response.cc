#include "client_libs/cpp/counted_response.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <utility>

namespace hypermap::client {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

constexpr int kMap = v1::ReplicateResponse::kMapFieldNumber;

}  // namespace

bool CountedResponse::Parse(CodedInputStream& input, bool may_coalesce) {
  std::string rest;
  while (const uint32_t tag = input.ReadTag()) {
    if (!ParseField(tag, input, may_coalesce, &rest)) return false;
  }
  return input.ConsumedEntireMessage() && rest_.ParseFromString(rest);
}

bool CountedResponse::ParseField(uint32_t tag, CodedInputStream& input, bool may_coalesce,
                                 std::string* rest) {
  switch (WireFormatLite::GetTagFieldNumber(tag)) {
    case v1::WatchResponse::kChangesFieldNumber:
      ++num_changes_;
      return WireFormatLite::SkipField(&input, tag);
    case kMap:
      return WireFormatLite::SkipField(&input, tag);
    case v1::WatchResponse::kCoalescedFieldNumber: {
      int size = 0;
      if (!may_coalesce || !input.ReadVarintSizeAsInt(&size)) return false;
      const CodedInputStream::Limit outer = input.PushLimit(size);
      const bool parsed = coalesced_.emplace_back().Parse(input, /*may_coalesce=*/false);
      input.PopLimit(outer);
      return parsed;
    }
    default: {
      google::protobuf::io::StringOutputStream stream(rest);
      CodedOutputStream output(&stream);
      return WireFormatLite::SkipField(&input, tag, &output);
    }
  }
}

}  // namespace hypermap::client

namespace grpc {

Status SerializationTraits<hypermap::client::CountedResponse>::Deserialize(
    ByteBuffer* buffer, hypermap::client::CountedResponse* response) {
  bool parsed = false;
  {
    ProtoBufferReader reader(buffer);
    google::protobuf::io::CodedInputStream input(&reader);
    hypermap::client::CountedResponse read;
    parsed = reader.status().ok() && read.Parse(input);
    *response = std::move(read);
  }
  buffer->Clear();
  return parsed ? Status::OK : Status(StatusCode::INTERNAL, "the message can't be parsed");
}

}  // namespace grpc
