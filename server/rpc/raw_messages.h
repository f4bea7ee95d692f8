// Parses and serializes the messages of raw methods, whose requests and responses are bytes to
// gRPC.
#ifndef HYPERMAP_SERVER_RPC_RAW_MESSAGES_H_
#define HYPERMAP_SERVER_RPC_RAW_MESSAGES_H_

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include <cstddef>
#include <string>

#include "absl/status/status.h"
#include "base/limits/limits.h"

namespace hypermap::server {

// The name of the map in a request: of its scope, or a field of its own; of its target if it has a
// source and a target. Empty for requests that name none.
template <typename Request>
std::string MapOf(const Request& request) {
  if constexpr (requires { request.scope(); }) {
    return request.scope().map();
  } else if constexpr (requires { request.map(); }) {
    return request.map();
  } else if constexpr (requires { request.target().scope(); }) {
    return request.target().scope().map();
  } else {
    return "";
  }
}

// The name of the map that is the source of a request with a source and a target. Empty for others.
template <typename Request>
std::string SourceMapOf(const Request& request) {
  if constexpr (requires { request.source().scope(); }) {
    return request.source().scope().map();
  } else {
    return "";
  }
}

// Returns whether the request is counted (CallTicket::CostOfRequest) and parsed on gRPC's thread,
// in less time than a worker needs to wake up. A worker does so with larger ones: 16 MiB of empty
// fields take seconds.
inline bool IsSmallRequest(const grpc::ByteBuffer& request) {
  constexpr size_t kFewBytes = 16 << 10;
  return request.Length() <= kFewBytes;
}

// RESOURCE_EXHAUSTED for a request of more bytes. To be called before it is parsed, which takes
// milliseconds for large ones.
absl::Status CheckRequestSize(const grpc::ByteBuffer& request, size_t most_bytes);

// The same for a question with an area, which must have too many vertices if it has so many bytes;
// names --max_question_vertices.
absl::Status CheckQuestionSize(const grpc::ByteBuffer& request, const Limits& limits);

// The same for a batch of points; names --max_points.
absl::Status CheckBatchSize(const grpc::ByteBuffer& request, const Limits& limits);

// Fills the empty message. INVALID_ARGUMENT for bytes that are no such message, which is empty
// then.
absl::Status ParseRequest(const grpc::ByteBuffer& bytes, google::protobuf::Message* request);

grpc::Slice Serialize(const google::protobuf::Message& message);

}  // namespace hypermap::server

#endif  // HYPERMAP_SERVER_RPC_RAW_MESSAGES_H_
