// Closed-loop load: each caller has one call outstanding, on its own connection. The same code
// loads every server. Requests are serialised beforehand; answers are counted and dropped.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_LOAD_H_
#define HYPERMAP_TESTS_BENCH_SERVER_LOAD_H_

#include <grpcpp/channel.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "google/protobuf/message_lite.h"

namespace hypermap::bench {

using Channels = std::vector<std::shared_ptr<grpc::Channel>>;

// Opens `count` connections that share nothing.
Channels OpenChannels(const std::string& address, int count);

grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message);
std::string Joined(const grpc::ByteBuffer& bytes);

// Calls of one method.
struct Calls {
  std::string method;     // "/hypermap.v1.QueryService/QueryPoint"
  bool streamed = false;  // the server answers with a stream
  // Returns the request of the i-th call of a run. Called by many threads.
  std::function<grpc::ByteBuffer(int64_t i)> request;
};

// Returns the requests in turn, starting over after the last.
std::function<grpc::ByteBuffer(int64_t)> InTurn(std::vector<grpc::ByteBuffer> requests);

struct LoadResult {
  int64_t calls = 0;
  absl::Duration wall;
  std::vector<double> latencies_s;  // sorted

  double Percentile(double share) const;
};

// Runs one caller for each channel for `duration`. The first error of a call ends all callers.
absl::StatusOr<LoadResult> RunLoad(const Channels& channels, const Calls& calls,
                                   absl::Duration duration);

// Makes the first `count` calls and returns their answers. The messages of a stream are joined.
absl::StatusOr<std::vector<std::string>> Ask(const Channels& channels, const Calls& calls,
                                             int64_t count);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_LOAD_H_
