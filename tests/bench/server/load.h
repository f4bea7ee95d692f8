// Closed-loop load: callers that each have one call outstanding, on connections of their own. The
// same code asks every server: requests are bytes that lie ready, answers are counted and dropped.
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

// Connections that share nothing.
Channels OpenChannels(const std::string& address, int count);

grpc::ByteBuffer ToBytes(const google::protobuf::MessageLite& message);
std::string Joined(const grpc::ByteBuffer& bytes);

// Calls of one method.
struct Calls {
  std::string method;     // "/hypermap.v1.QueryService/QueryPoint"
  bool streamed = false;  // the server answers with a stream
  // The request of the i-th call of a run. Called by many threads.
  std::function<grpc::ByteBuffer(int64_t i)> request;
};

// The requests in turn, again from the beginning after the last.
std::function<grpc::ByteBuffer(int64_t)> InTurn(std::vector<grpc::ByteBuffer> requests);

struct LoadResult {
  int64_t calls = 0;
  absl::Duration wall;
  std::vector<double> latencies_s;  // sorted

  double Percentile(double share) const;
};

// One caller for each channel, until `duration` is over. The first error of a call ends all.
absl::StatusOr<LoadResult> RunLoad(const Channels& channels, const Calls& calls,
                                   absl::Duration duration);

// Makes the first `count` calls; their answers' messages, those of a stream one after another.
absl::StatusOr<std::vector<std::string>> Ask(const Channels& channels, const Calls& calls,
                                             int64_t count);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_LOAD_H_
