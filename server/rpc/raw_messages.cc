#include "server/rpc/raw_messages.h"

#include <grpcpp/support/proto_buffer_reader.h>

#include <cstdint>

#include "absl/strings/str_cat.h"

namespace hypermap::server {

absl::Status CheckRequestSize(const grpc::ByteBuffer& request, size_t most_bytes) {
  if (request.Length() <= most_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the request has ", request.Length(),
                                                   " bytes, more than the ", most_bytes,
                                                   " that this rpc takes"));
}

absl::Status CheckQuestionSize(const grpc::ByteBuffer& request, const Limits& limits) {
  // A vertex takes 16 bytes; the least ring, of three, has 8 bytes besides.
  constexpr size_t kBytesOfVertex = 24;
  // All but the area: the names of layers, above all.
  const size_t most = FixedLimits::kMaxRequestBytes +
                      kBytesOfVertex * static_cast<size_t>(limits.max_question_vertices);
  if (request.Length() <= most) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("the question has ", request.Length(), " bytes, more than ", most,
                   ": --max_question_vertices is ", limits.max_question_vertices));
}

absl::Status ParseRequest(const grpc::ByteBuffer& bytes, google::protobuf::Message* request) {
  grpc::Slice slice;
  // Most requests are one slice. Larger ones are read slice by slice, without a copy that joins
  // them. The reader does not change the buffer.
  bool read = false;
  if (bytes.TrySingleSlice(&slice).ok()) {
    read = request->ParseFromArray(slice.begin(), static_cast<int>(slice.size()));
  } else if (bytes.Valid()) {
    grpc::ProtoBufferReader reader(const_cast<grpc::ByteBuffer*>(&bytes));
    read = request->ParseFromZeroCopyStream(&reader);
  }
  if (read) return absl::OkStatus();
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
