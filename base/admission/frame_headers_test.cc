#include "base/admission/frame_headers.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <random>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::admission {
namespace {

constexpr int kMaxFrame = 16'384;

std::string Frame(int type, int flags, uint32_t stream, const std::string& payload = "") {
  std::string header;
  const auto length = static_cast<uint32_t>(payload.size());
  for (const int shift : {16, 8, 0}) header += static_cast<char>(length >> shift);
  header += static_cast<char>(type);
  header += static_cast<char>(flags);
  for (const int shift : {24, 16, 8, 0}) header += static_cast<char>(stream >> shift);
  return header + payload;
}

std::string Repeated(const std::string& text, size_t size) {
  std::string repeated;
  while (repeated.size() < size) repeated += text;
  return repeated;
}

// The end of a connection's bytes, which begins within a frame.
ChainedFrames LookAt(const std::string& bytes, size_t begin) {
  return FindChains(absl::string_view(bytes).substr(begin, kMaxChainedBytes));
}

TEST(FindChainsTest, BlockOfHeadersInManyFramesIsFoundFromAnyByte) {
  const std::string bytes = Repeated(Frame(9, 0, 1, std::string(kMaxFrame, 'x')), 200'000);
  for (size_t begin = 0; begin < 2 * kMaxFrame; begin += 97) {
    EXPECT_GE(LookAt(bytes, begin).num_continuations, 3) << begin;
    EXPECT_GE(LookAt(bytes, begin).continuation_bytes, 3 * kMaxFrame - 9) << begin;
  }
  const std::string empty = Repeated(Frame(9, 0, 1), 65'536);
  for (size_t begin = 0; begin < 20; ++begin) {
    EXPECT_GE(LookAt(empty, begin).num_continuations, 1'000) << begin;
    EXPECT_GE(LookAt(empty, begin).num_empty, 1'000) << begin;
  }
}

TEST(FindChainsTest, FramesThatCarryNothingAreFoundFromAnyByte) {
  for (const std::string& frame :
       {Frame(0, 0, 1), Frame(8, 0, 0, std::string("\0\0\0\1", 4)),
        Frame(2, 0, 1, std::string("\0\0\0\0\1", 5)), Frame(4, 0, 0), Frame(6, 0, 0, "12345678"),
        Frame(0xee, 0, 0), Frame(3, 0, 7, std::string("\0\0\0\x08", 4)),
        Frame(7, 0, 0, std::string(8, '\0')),
        // Frames that are skipped between them change nothing.
        Frame(0, 0, 3) + Frame(0xfa, 0, 7, "skipped")}) {
    const std::string bytes = Repeated(frame, 20'000);
    for (size_t begin = 0; begin < 30; ++begin) {
      EXPECT_GE(LookAt(bytes, begin).num_empty, 700)
          << "type " << int{frame[3]} << " from " << begin;
    }
  }
}

TEST(FindChainsTest, CallsWithTheirMessagesAreNoFlood) {
  // 64 KiB of small calls: headers, a message, an empty frame that ends the stream, and the
  // acknowledgement of a ping now and then.
  std::string bytes;
  for (uint32_t stream = 1; bytes.size() < 65'536; stream += 2) {
    bytes += Frame(1, 4, stream, std::string(40, '\xbf')) +
             Frame(0, 0, stream, std::string("\0\0\0\0\x14", 5) + std::string(20, '\x0a')) +
             Frame(0, 1, stream);
    if (stream % 20 == 1) bytes += Frame(8, 0, 0, std::string("\0\1\0\0", 4));
  }
  const ChainedFrames found = LookAt(bytes, 0);
  EXPECT_LT(found.num_empty, 100);
  EXPECT_EQ(found.num_continuations, 0);
  // A block of headers of 32 KB.
  const std::string block = Frame(1, 0, 1, std::string(kMaxFrame, 'a')) +
                            Frame(9, 4, 1, std::string(kMaxFrame, 'a')) +
                            Repeated(Frame(0, 0, 1, std::string(1'000, 'm')), 30'000);
  EXPECT_LT(LookAt(block, 0).num_continuations, 3);
}

TEST(FindChainsTest, MessagesAreNotTakenForFrames) {
  constexpr int kSeed = 1;
  RecordProperty("seed", kSeed);
  std::mt19937 random(kSeed);
  const auto upload = [](const std::string& content) {
    std::string frames;
    for (size_t at = 0; at < content.size(); at += kMaxFrame) {
      frames += Frame(0, 0, 1, content.substr(at, kMaxFrame));
    }
    return frames;
  };
  for (int round = 0; round < 60; ++round) {
    // Bytes of few values are full of zeros, lengths and types.
    const int most = round % 3 == 0 ? 255 : round % 3 == 1 ? 9 : 1;
    std::string content(100'000, '\0');
    for (char& byte : content) byte = static_cast<char>(random() % (most + 1));
    for (const std::string& bytes : {content, upload(content)}) {
      const ChainedFrames found = LookAt(bytes, random() % 20'000);
      EXPECT_LT(found.num_empty, 100) << round;
      EXPECT_LT(found.num_continuations, 3) << round;
    }
  }
  for (const int value : {0, 1, 4, 8, 9, 255}) {
    const std::string content(100'000, static_cast<char>(value));
    EXPECT_LT(LookAt(content, 0).num_empty, 100) << value;
    EXPECT_LT(LookAt(upload(content), 77).num_continuations, 3) << value;
  }
  // A recorded flood within a message ends where the frame does that carries it.
  for (const std::string& flood : {Frame(9, 0, 1, "x"), Frame(0, 0, 1)}) {
    const std::string bytes = upload(Repeated(flood, 20'000) + std::string(100'000, 'x'));
    for (size_t begin = 0; begin < 20'000; begin += 1'001) {
      const ChainedFrames found = LookAt(bytes, begin);
      EXPECT_LT(found.num_empty, 100) << begin;
      EXPECT_LT(found.num_continuations, 3) << begin;
    }
  }
}

TEST(FindChainsTest, NumbersInAMessageAreNoLongBlockOfHeaders) {
  // A number in each nine bytes looks like frames without content while it has certain values.
  std::string numbers;
  for (uint32_t i = 0; i < 10'000; ++i) numbers += Frame(3, 0, 2 * i + 1);
  for (size_t begin = 0; begin < 20'000; begin += 999) {
    EXPECT_LT(LookAt(numbers, begin).continuation_bytes, 32'768) << begin;
  }
}

TEST(FindResetsTest, CallsThatBeginHereAreCountedUpToABound) {
  std::string bytes;
  for (uint32_t stream = 1; stream < 401; stream += 2) {
    bytes += Frame(1, 4, stream, "header") + Frame(3, 0, stream, std::string("\0\0\0\x08", 4));
  }
  const Resets resets = FindResets(bytes, 60);
  EXPECT_EQ(resets.count, 200);
  EXPECT_EQ(resets.num_begun_here, 60);
  EXPECT_EQ(resets.last_stream, 399u);
}

}  // namespace
}  // namespace hypermap::admission
