// Parses and serializes the messages of raw methods, whose requests and responses are bytes to
// gRPC.
#ifndef HYPERMAP_SERVER_RPC_RAW_MESSAGES_H_
#define HYPERMAP_SERVER_RPC_RAW_MESSAGES_H_

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include "absl/status/status.h"

namespace hypermap::server {

// Fills the empty message. INVALID_ARGUMENT for bytes that are no such message, which is empty
// then.
absl::Status ParseRequest(const grpc::ByteBuffer& bytes, google::protobuf::Message* request);

grpc::Slice Serialize(const google::protobuf::Message& message);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_RAW_MESSAGES_H_
