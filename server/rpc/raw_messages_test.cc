#include "server/rpc/raw_messages.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hypermap/v1/query_service.pb.h"

namespace hypermap::server {
namespace {

v1::QueryAreaRequest AnyRequest() {
  v1::QueryAreaRequest request;
  request.mutable_scope()->set_map("lab");
  request.mutable_scope()->add_layers("objects");
  request.mutable_area()->mutable_outer()->add_xs(1.5);
  return request;
}

TEST(RawMessages, RequestIsReadBack) {
  const grpc::Slice slice = Serialize(AnyRequest());
  v1::QueryAreaRequest parsed;
  ASSERT_TRUE(ParseRequest(grpc::ByteBuffer(&slice, 1), &parsed).ok());
  EXPECT_EQ(parsed.SerializeAsString(), AnyRequest().SerializeAsString());
}

TEST(RawMessages, RequestInPiecesIsReadBack) {
  const std::string bytes = AnyRequest().SerializeAsString();
  std::vector<grpc::Slice> pieces;
  for (const char c : bytes) pieces.emplace_back(std::string(1, c));
  v1::QueryAreaRequest parsed;
  ASSERT_TRUE(ParseRequest(grpc::ByteBuffer(pieces.data(), pieces.size()), &parsed).ok());
  EXPECT_EQ(parsed.SerializeAsString(), bytes);
}

TEST(RawMessages, BytesThatAreNoRequestAreRefused) {
  const grpc::Slice slice(std::string("\x0a\x03lab\x0a\xff"));
  v1::QueryAreaRequest parsed;
  const absl::Status status = ParseRequest(grpc::ByteBuffer(&slice, 1), &parsed);
  EXPECT_EQ(status,
            absl::InvalidArgumentError("the request is not a hypermap.v1.QueryAreaRequest"));
  EXPECT_EQ(parsed.scope().map(), "");
}

TEST(RawMessages, NoBytesAreARequestOfDefaults) {
  const grpc::Slice empty;
  v1::QueryAreaRequest parsed;
  EXPECT_TRUE(ParseRequest(grpc::ByteBuffer(&empty, 1), &parsed).ok());
}

}  // namespace
}  // namespace hypermap::server
