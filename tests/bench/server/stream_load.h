// Load by bidirectional streams whose messages are answered one by one, several outstanding at a
// time.
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
  // Sent first; it gets no answer.
  std::optional<grpc::ByteBuffer> opening;
  // Sent in turn; each gets one message as answer.
  std::vector<grpc::ByteBuffer> messages;
  // Maximum number of outstanding messages.
  int window = 4;
};

// Runs one stream for each channel for `duration`, and then until all messages are answered.
absl::StatusOr<LoadResult> RunStreams(const Channels& channels, const StreamCalls& calls,
                                      absl::Duration duration);

// Returns the answers to the first `count` messages, from one stream.
absl::StatusOr<std::vector<std::string>> AskStream(const Channels& channels,
                                                   const StreamCalls& calls, int count);

}  // namespace hypermap::bench

#endif  // HYPERMAP_TESTS_BENCH_SERVER_STREAM_LOAD_H_
