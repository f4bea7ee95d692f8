// Load by streams of messages that are answered one by one, several on their way at a time.
#ifndef HYPERMAP_TESTS_BENCH_SERVER_STREAM_LOAD_H_
#define HYPERMAP_TESTS_BENCH_SERVER_STREAM_LOAD_H_

#include <grpcpp/support/byte_buffer.h>

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "tests/bench/server/load.h"

namespace hypermap::bench {

struct StreamCalls {
  std::string method;
  // Sent first, not answered.
  std::optional<grpc::ByteBuffer> opening;
  // Sent in turn, each answered with one message.
  std::vector<grpc::ByteBuffer> messages;
  // How many may be on their way.
  int window = 4;
};

// One stream for each channel until `duration` is over and all is answered.
absl::StatusOr<LoadResult> RunStreams(const Channels& channels, const StreamCalls& calls,
                                      absl::Duration duration);

// The answers to the first `count` messages, from one stream.
absl::StatusOr<std::vector<std::string>> AskStream(const Channels& channels,
                                                   const StreamCalls& calls, int count);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_STREAM_LOAD_H_
