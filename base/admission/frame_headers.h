// Frames of HTTP/2 (RFC 9113) among bytes of a connection that may begin within a frame.
#ifndef HYPERMAP_BASE_ADMISSION_FRAME_HEADERS_H_
#define HYPERMAP_BASE_ADMISSION_FRAME_HEADERS_H_

#include <cstdint>

#include "absl/strings/string_view.h"

namespace hypermap::admission {

struct Resets {
  int count = 0;
  // Number of those among the first 2 * most_begun whose stream begins in the same bytes, counted
  // up to `most_begun`.
  int num_begun_here = 0;
  uint32_t last_stream = 0;
};

// Finds the RST_STREAM frames: headers of such frames, each of a stream of the client later than
// that of the one before, so that other data is not taken for them.
Resets FindResets(absl::string_view bytes, int most_begun);

struct ChainedFrames {
  // Frames that carry nothing: WINDOW_UPDATE, PRIORITY, SETTINGS, PING and GOAWAY, and frames
  // without content, but for the empty DATA that ends a stream. Also RST_STREAM frames of the same
  // stream as the next one, or a later one.
  int num_empty = 0;
  // CONTINUATION frames of one stream that follow each other.
  int num_continuations = 0;
  // The bytes of such frames that are there.
  int continuation_bytes = 0;
};

// Finds the chain of frames that runs to the end of the bytes and has the most of each kind. Each
// frame of a chain has a header that a client may send, and ends where the next one begins. A chain
// has at least three frames. Takes about 3 ns for each byte, whatever the bytes are; bytes beyond
// kMaxChainedBytes are not looked at.
inline constexpr int kMaxChainedBytes = 65'536;
ChainedFrames FindChains(absl::string_view bytes);

}  // namespace hypermap::admission

#endif  // HYPERMAP_BASE_ADMISSION_FRAME_HEADERS_H_
