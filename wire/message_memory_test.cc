#include "wire/message_memory.h"

#include <grpcpp/impl/grpc_library.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hypermap/v1/edit_service.pb.h"
#include "hypermap/v1/ingest_service.pb.h"
#include "hypermap/v1/query_service.pb.h"

namespace hypermap::wire {
namespace {

// ByteBuffer needs it. Programs with a server or a channel have it from there, even if gRPC is
// linked statically.
const grpc::internal::GrpcLibraryInitializer kInitializeGrpc;

grpc::ByteBuffer BufferOf(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

int64_t Estimate(const google::protobuf::Message& message) {
  return MemoryOfMessage(message, BufferOf(message.SerializeAsString()));
}

// Expects that the estimate is not below what the parsed message takes, and not far above.
template <typename Message>
void ExpectCloseEstimate(const std::string& bytes) {
  Message parsed;
  ASSERT_TRUE(parsed.ParseFromString(bytes));
  const auto used = static_cast<int64_t>(parsed.SpaceUsedLong());
  const int64_t estimate = MemoryOfMessage(Message::default_instance(), BufferOf(bytes));
  EXPECT_GE(estimate, used);
  EXPECT_LE(estimate, 3 * used);
}

std::string Repeated(const std::string& part, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += part;
  return all;
}

v1::ApplyEditsRequest Objects(int count) {
  v1::ApplyEditsRequest request;
  for (int i = 0; i < count; ++i) {
    v1::PutObject& put = *request.add_edits()->mutable_put_object();
    put.set_layer("cups");
    put.mutable_object()->set_label("cup");
    (*put.mutable_object()->mutable_attributes())["colour"].set_string_value("a red like brown");
    v1::Ring& ring = *put.mutable_object()->mutable_shape()->mutable_polygon()->mutable_outer();
    for (int j = 0; j < 5; ++j) {
      ring.add_xs(j);
      ring.add_ys(i);
    }
  }
  return request;
}

TEST(MessageMemory, OfObjectsIsThatOfTheParsedMessage) {
  ExpectCloseEstimate<v1::ApplyEditsRequest>(Objects(1000).SerializeAsString());
}

TEST(MessageMemory, OfPointsIsThatOfTheParsedMessage) {
  v1::QueryPointsRequest request;
  for (int i = 0; i < 10'000; ++i) {
    request.add_xs(i);
    request.add_ys(i);
  }
  ExpectCloseEstimate<v1::QueryPointsRequest>(request.SerializeAsString());
}

TEST(MessageMemory, OfEmptyElementsIsThatOfTheParsedMessage) {
  v1::ApplyEditsRequest edits;
  for (int i = 0; i < 10'000; ++i) edits.add_edits();
  ExpectCloseEstimate<v1::ApplyEditsRequest>(edits.SerializeAsString());
  EXPECT_GE(Estimate(edits), static_cast<int64_t>(20 * edits.ByteSizeLong()));

  v1::QueryPointRequest names;
  for (int i = 0; i < 10'000; ++i) names.mutable_scope()->add_layers("");
  ExpectCloseEstimate<v1::QueryPointRequest>(names.SerializeAsString());
}

TEST(MessageMemory, OfUnknownFieldsIsThatOfTheParsedMessage) {
  const std::vector<std::string> fields = {
      std::string("\xf8\x7f\x01", 3),                               // a varint
      std::string("\xfa\x7f\x00", 3),                               // an empty string
      std::string("\xfd\x7f\x01\x02\x03\x04", 6),                   // 32 bits
      std::string("\xf9\x7f\x01\x02\x03\x04\x05\x06\x07\x08", 10),  // 64 bits
      std::string("\xfb\x7f\xfc\x7f", 4)};                          // a group
  for (const std::string& field : fields) {
    ExpectCloseEstimate<v1::QueryPointRequest>(Repeated(field, 10'000));
  }
}

TEST(MessageMemory, OfPackedVarintsCountsTheNumbers) {
  v1::ApplyEditsResponse response;
  for (int i = 0; i < 10'000; ++i) response.add_object_ids(i);
  ExpectCloseEstimate<v1::ApplyEditsResponse>(response.SerializeAsString());
}

TEST(MessageMemory, OfBytesInPiecesIsTheSame) {
  const std::string bytes = Objects(3).SerializeAsString();
  std::vector<grpc::Slice> pieces;
  for (const char c : bytes) pieces.emplace_back(std::string(1, c));
  EXPECT_EQ(MemoryOfMessage(v1::ApplyEditsRequest::default_instance(),
                            grpc::ByteBuffer(pieces.data(), pieces.size())),
            Estimate(Objects(3)));
}

TEST(MessageMemory, OfAnyBytesIsFinite) {
  const std::string good = Objects(2).SerializeAsString();
  // Cut anywhere, and with any byte changed: no fault of memory, and no more than for good ones.
  for (size_t cut = 0; cut <= good.size(); ++cut) {
    EXPECT_LE(
        MemoryOfMessage(v1::ApplyEditsRequest::default_instance(), BufferOf(good.substr(0, cut))),
        Estimate(Objects(2)));
  }
  for (size_t i = 0; i < good.size(); ++i) {
    for (const char change : {'\x00', '\x7f', '\x80', '\xff'}) {
      std::string bad = good;
      bad[i] = change;
      EXPECT_GE(MemoryOfMessage(v1::ApplyEditsRequest::default_instance(), BufferOf(bad)), 0);
    }
  }
  EXPECT_GT(MemoryOfMessage(v1::ApplyEditsRequest::default_instance(), grpc::ByteBuffer()), 0);
}

TEST(MessageMemory, OfDeepNestingEnds) {
  // A length-delimited field 1 within field 1 within ..., of a type that does not know field 1
  // there.
  std::string nested;
  for (int i = 0; i < 1000; ++i) {
    std::string outer(1, '\x0a');
    size_t size = nested.size();
    for (; size >= 0x80; size >>= 7) outer += static_cast<char>((size & 0x7f) | 0x80);
    outer += static_cast<char>(size);
    nested = outer + nested;
  }
  EXPECT_GT(MemoryOfMessage(v1::ApplyEditsRequest::default_instance(), BufferOf(nested)), 0);
}

}  // namespace
}  // namespace hypermap::wire
