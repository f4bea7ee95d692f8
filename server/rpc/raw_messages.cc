#include "server/rpc/raw_messages.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <cstdint>

#include "absl/strings/str_cat.h"
#include "base/cancellation/give_way.h"

namespace hypermap::server {

absl::Status CheckRequestSize(const grpc::ByteBuffer& request, size_t most_bytes) {
  if (request.Length() <= most_bytes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the request has ", request.Length(),
                                                   " bytes, more than the ", most_bytes,
                                                   " that this rpc takes"));
}

absl::Status CheckBatchSize(const grpc::ByteBuffer& request, const Limits& limits) {
  // Upper bound of the bytes of a point: two doubles, each with its tag if they are not packed.
  constexpr size_t kBytesOfPoint = 24;
  const size_t most =
      FixedLimits::kMaxRequestBytes + kBytesOfPoint * static_cast<size_t>(limits.max_points);
  if (request.Length() <= most) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("the batch has ", request.Length(),
                                                   " bytes, more than ", most, ": --max_points is ",
                                                   limits.max_points));
}

absl::Status CheckQuestionSize(const grpc::ByteBuffer& request, const Limits& limits) {
  // Upper bound of the bytes of a vertex: two doubles, and its part of the tags and lengths of a
  // ring, which are about 8 bytes for at least three vertices.
  constexpr size_t kBytesOfVertex = 24;
  // With room for all other fields, most of it for names of layers.
  const size_t most = FixedLimits::kMaxRequestBytes +
                      kBytesOfVertex * static_cast<size_t>(limits.max_question_vertices);
  if (request.Length() <= most) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("the question has ", request.Length(), " bytes, more than ", most,
                   ": --max_question_vertices is ", limits.max_question_vertices));
}

namespace {

// Reads a request slice by slice, without a copy that joins them, and gives way between them: a
// message of 16 MiB takes some milliseconds.
class SliceReader final : public google::protobuf::io::ZeroCopyInputStream {
 public:
  // The reader does not change the buffer.
  explicit SliceReader(const grpc::ByteBuffer& bytes)
      : reader_(const_cast<grpc::ByteBuffer*>(&bytes)) {}

  bool Next(const void** data, int* size) override {
    GiveWay();
    return reader_.Next(data, size);
  }
  void BackUp(int count) override { reader_.BackUp(count); }
  bool Skip(int count) override { return reader_.Skip(count); }
  int64_t ByteCount() const override { return reader_.ByteCount(); }

 private:
  grpc::ProtoBufferReader reader_;
};

// Larger messages are written in pieces of this size.
constexpr int kPieceBytes = 64 << 10;

// Writes a message into an array, and gives way between its pieces.
class PieceWriter final : public google::protobuf::io::ZeroCopyOutputStream {
 public:
  PieceWriter(uint8_t* bytes, int size) : writer_(bytes, size, kPieceBytes) {}

  bool Next(void** data, int* size) override {
    GiveWay();
    return writer_.Next(data, size);
  }
  void BackUp(int count) override { writer_.BackUp(count); }
  int64_t ByteCount() const override { return writer_.ByteCount(); }

 private:
  google::protobuf::io::ArrayOutputStream writer_;
};

}  // namespace

absl::Status ParseRequest(const grpc::ByteBuffer& bytes, google::protobuf::Message* request) {
  grpc::Slice slice;
  // Most requests are one slice.
  bool read = false;
  if (bytes.TrySingleSlice(&slice).ok()) {
    read = request->ParseFromArray(slice.begin(), static_cast<int>(slice.size()));
  } else if (bytes.Valid()) {
    SliceReader reader(bytes);
    read = request->ParseFromZeroCopyStream(&reader);
  }
  if (read) return absl::OkStatus();
  request->Clear();
  return absl::InvalidArgumentError(absl::StrCat("the request is not a ", request->GetTypeName()));
}

grpc::Slice Serialize(const google::protobuf::Message& message) {
  grpc::Slice slice(message.ByteSizeLong());
  // A slice may be written as long as no other refers to its bytes.
  auto* const bytes = const_cast<uint8_t*>(slice.begin());
  if (slice.size() <= size_t{kPieceBytes}) {
    message.SerializeWithCachedSizesToArray(bytes);
  } else {
    PieceWriter writer(bytes, static_cast<int>(slice.size()));
    message.SerializeToZeroCopyStream(&writer);
  }
  return slice;
}

}  // namespace hypermap::server
