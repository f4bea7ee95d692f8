#include "base/admission/frame_headers.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace hypermap::admission {
namespace {

constexpr size_t kHeaderBytes = 9;

enum Type : uint8_t {
  kData = 0,
  kHeaders = 1,
  kPriority = 2,
  kReset = 3,
  kSettings = 4,
  kPushPromise = 5,
  kPing = 6,
  kGoAway = 7,
  kWindowUpdate = 8,
  kContinuation = 9,
};
constexpr uint8_t kEndStream = 1;

// Returns the number that begins with the highest byte.
uint32_t StreamOf(absl::string_view bytes) {
  uint32_t stream = 0;
  for (const char byte : bytes.substr(0, sizeof stream)) {
    stream = stream << 8 | static_cast<unsigned char>(byte);
  }
  return stream;
}

// Returns whether `bytes` hold the header of a HEADERS frame of the stream: its type, any flags,
// and the four bytes of the stream.
bool BeginsStream(absl::string_view bytes, absl::string_view stream) {
  constexpr size_t kTypeAndFlags = 2;
  for (size_t at = bytes.find(stream); at != bytes.npos; at = bytes.find(stream, at + 1)) {
    if (at >= kTypeAndFlags && bytes[at - kTypeAndFlags] == kHeaders) return true;
  }
  return false;
}

struct Header {
  uint32_t length;
  uint8_t type;
  uint8_t flags;
  // With the reserved bit, which receivers ignore, cleared.
  uint32_t stream;
};

Header HeaderAt(const unsigned char* at) {
  const auto word = [](const unsigned char* p) {
    return uint32_t{p[0]} << 24 | uint32_t{p[1]} << 16 | uint32_t{p[2]} << 8 | p[3];
  };
  return {word(at) >> 8, at[3], at[4], word(at + 5) & 0x7fff'ffff};
}

// Returns whether a server goes on after such a frame: the lengths and streams of RFC 9113,
// section 6. The length is bounded, so that text is no header: gRPC takes frames of 16 KiB at
// first, and somewhat larger ones from clients with fast links.
bool IsPlausible(const Header& header) {
  constexpr uint32_t kMaxLength = 1 << 20;
  constexpr uint32_t kMaxUnknownLength = 16'384;
  if (header.length > kMaxLength) return false;
  const bool of_client = header.stream % 2 == 1;
  switch (header.type) {
    case kData:
    case kHeaders:
    case kContinuation:
      return of_client;
    case kPriority:
      return of_client && header.length == 5;
    case kReset:
      return of_client && header.length == 4;
    case kSettings:
      return header.stream == 0 && header.length % 6 == 0;
    case kPushPromise:
      return false;
    case kPing:
      return header.stream == 0 && header.length == 8;
    case kGoAway:
      return header.stream == 0 && header.length >= 8;
    case kWindowUpdate:
      return header.length == 4 && (header.stream == 0 || of_client);
    default:
      // Frames of unknown types are skipped.
      return header.length <= kMaxUnknownLength;
  }
}

bool IsEmpty(const Header& header) {
  switch (header.type) {
    case kPriority:
    case kSettings:
    case kPing:
    case kGoAway:
    case kWindowUpdate:
      return true;
    case kData:
      return header.length == 0 && (header.flags & kEndStream) == 0;
    default:
      return header.length == 0;
  }
}

// The chain from one place to the end of the bytes.
struct Chain {
  // Frames; -1 if there is no chain.
  int16_t num_frames = -1;
  int16_t num_empty = 0;
  // Number of CONTINUATION frames at the chain's begin, and the most that follow each other in it.
  int16_t num_first_continuations = 0;
  int16_t num_continuations = 0;
  // Bytes of these two sequences.
  int32_t first_continuation_bytes = 0;
  int32_t continuation_bytes = 0;
  uint32_t first_stream = 0;
  // Stream of the RST_STREAM frame at the chain's begin; 0 if it begins with another frame.
  uint32_t reset_stream = 0;
};

}  // namespace

Resets FindResets(absl::string_view bytes, int most_begun) {
  // The header's length, type and flags.
  static constexpr absl::string_view kResetBegin("\0\0\x04\x03\0", 5);
  constexpr size_t kTypeAt = 3;
  // A call that is begun and cancelled at once takes no more than this.
  constexpr size_t kCallBytes = 1'024;
  Resets resets;
  // The type is searched for: many connections send mostly zeros.
  for (size_t type = bytes.find(kReset, kTypeAt);
       type != bytes.npos && type - kTypeAt + kHeaderBytes <= bytes.size();
       type = bytes.find(kReset, type + 1)) {
    const size_t at = type - kTypeAt;
    if (bytes.substr(at, kResetBegin.size()) != kResetBegin) continue;
    const uint32_t stream = StreamOf(bytes.substr(at + kResetBegin.size()));
    if (stream % 2 == 0 || stream <= resets.last_stream) continue;
    resets.last_stream = stream;
    ++resets.count;
    // Each of these takes some microseconds.
    if (resets.num_begun_here >= most_begun || resets.count > 2 * most_begun) continue;
    const size_t from = at < kCallBytes ? 0 : at - kCallBytes;
    const absl::string_view before = bytes.substr(from, at - from);
    if (BeginsStream(before, bytes.substr(at + kResetBegin.size(), sizeof stream))) {
      ++resets.num_begun_here;
    }
  }
  return resets;
}

ChainedFrames FindChains(absl::string_view bytes) {
  constexpr int kMinFrames = 3;
  bytes = bytes.substr(0, kMaxChainedBytes);
  if (bytes.size() < kHeaderBytes) return {};
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const size_t num_places = bytes.size() - kHeaderBytes + 1;
  // From the end, so that each place is looked at once. The memory is kept for the next call.
  thread_local std::vector<Chain> chains;
  chains.assign(num_places, Chain());
  ChainedFrames found;
  for (size_t at = num_places; at-- > 0;) {
    const Header header = HeaderAt(data + at);
    if (!IsPlausible(header)) continue;
    const size_t next = at + kHeaderBytes + header.length;
    Chain chain;
    chain.num_frames = 0;
    if (next < num_places) {
      if (chains[next].num_frames < 0) continue;
      chain = chains[next];
    }
    ++chain.num_frames;
    // Clients cancel a call once, and mostly in the order of their calls: a stream that is reset
    // again, or after a later one, carries nothing. FindResets counts the calls that begin and are
    // cancelled in these bytes.
    const bool is_reset_again =
        header.type == kReset && chain.reset_stream != 0 && chain.reset_stream <= header.stream;
    if (IsEmpty(header) || is_reset_again) ++chain.num_empty;
    chain.reset_stream = header.type == kReset ? header.stream : 0;
    if (header.type == kContinuation) {
      const bool goes_on = chain.first_stream == header.stream;
      chain.num_first_continuations =
          static_cast<int16_t>(goes_on ? chain.num_first_continuations + 1 : 1);
      const auto size = static_cast<int32_t>(std::min(next, bytes.size()) - at);
      chain.first_continuation_bytes = size + (goes_on ? chain.first_continuation_bytes : 0);
      chain.continuation_bytes = std::max(chain.continuation_bytes, chain.first_continuation_bytes);
      chain.first_stream = header.stream;
      chain.num_continuations = std::max(chain.num_continuations, chain.num_first_continuations);
    } else {
      chain.num_first_continuations = 0;
      chain.first_continuation_bytes = 0;
      chain.first_stream = 0;
    }
    chains[at] = chain;
    if (chain.num_frames < kMinFrames) continue;
    found.num_empty = std::max<int>(found.num_empty, chain.num_empty);
    found.num_continuations = std::max<int>(found.num_continuations, chain.num_continuations);
    found.continuation_bytes = std::max(found.continuation_bytes, chain.continuation_bytes);
  }
  return found;
}

}  // namespace hypermap::admission
