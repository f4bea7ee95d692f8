#include "server/rpc/raw_messages.h"

#include <cstdint>

#include "absl/strings/str_cat.h"

namespace hypermap::server {

absl::Status ParseRequest(const grpc::ByteBuffer& bytes, google::protobuf::Message* request) {
  grpc::Slice slice;
  // Most requests are one slice, which is read without a copy; others must be joined.
  const bool read = bytes.TrySingleSlice(&slice).ok() || bytes.DumpToSingleSlice(&slice).ok();
  if (read && request->ParseFromArray(slice.begin(), static_cast<int>(slice.size()))) {
    return absl::OkStatus();
  }
  request->Clear();
  return absl::InvalidArgumentError(absl::StrCat("the request is not a ", request->GetTypeName()));
}

grpc::Slice Serialize(const google::protobuf::Message& message) {
  grpc::Slice slice(message.ByteSizeLong());
  // A slice may be written as long as no other refers to its bytes.
  message.SerializeWithCachedSizesToArray(const_cast<uint8_t*>(slice.begin()));
  return slice;
}

}  // namespace hypermap::server
