#include "base/images/png.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace hypermap {
namespace {

using ::testing::HasSubstr;

// Three rows of two pixels.
std::string Encoded(PngFormat format, const std::vector<uint8_t>& bytes) {
  format.width = 2;
  format.height = 3;
  absl::StatusOr<PngWriter> writer = PngWriter::Begin(format);
  EXPECT_TRUE(writer.ok()) << writer.status();
  for (int y = 0; y < 3; ++y) {
    EXPECT_TRUE(writer->WriteRow(bytes.data() + y * bytes.size() / 3).ok());
  }
  absl::StatusOr<std::string> data = (*std::move(writer)).Finish();
  EXPECT_TRUE(data.ok()) << data.status();
  return *std::move(data);
}

const std::vector<uint8_t> kTwelve = {0, 1, 2, 3, 4, 5, 6, 7, 250, 251, 252, 253};

TEST(PngTest, SamplesOf16BitsAreReadAsTheyWereWritten) {
  for (const bool is_fast : {false, true}) {
    const std::string data = Encoded({.bit_depth = 16, .is_fast = is_fast}, kTwelve);
    absl::StatusOr<PngReader> reader = PngReader::Open(data);
    ASSERT_TRUE(reader.ok()) << reader.status();
    EXPECT_EQ(reader->header().width, 2);
    EXPECT_EQ(reader->header().height, 3);
    EXPECT_EQ(reader->header().bit_depth, 16);
    EXPECT_TRUE(reader->header().is_grey);
    ASSERT_EQ(reader->row_bytes(), 4);
    std::vector<uint8_t> rows(12);
    ASSERT_TRUE(reader->ReadRows(rows.data()).ok());
    EXPECT_EQ(rows, kTwelve);
  }
}

TEST(PngTest, AlphaIsAChannel) {
  const std::string data = Encoded({.has_alpha = true}, kTwelve);
  absl::StatusOr<PngReader> reader = PngReader::Open(data);
  ASSERT_TRUE(reader.ok()) << reader.status();
  EXPECT_FALSE(reader->header().is_grey);
  ASSERT_TRUE(reader->ExpandTo8Bits().ok());
  EXPECT_EQ(reader->channels(), 2);
  EXPECT_EQ(reader->num_passes(), 1);
  std::vector<uint8_t> row(reader->row_bytes());
  ASSERT_TRUE(reader->ReadRow(row.data()).ok());
  EXPECT_EQ(row, (std::vector<uint8_t>{0, 1, 2, 3}));
}

TEST(PngTest, SixteenBitsAreReducedToTheHighByte) {
  const std::string data = Encoded({.bit_depth = 16}, kTwelve);
  absl::StatusOr<PngReader> reader = PngReader::Open(data);
  ASSERT_TRUE(reader.ok()) << reader.status();
  ASSERT_TRUE(reader->ExpandTo8Bits().ok());
  std::vector<uint8_t> rows(6);
  ASSERT_TRUE(reader->ReadRows(rows.data()).ok());
  EXPECT_EQ(rows, (std::vector<uint8_t>{0, 2, 4, 6, 250, 252}));
}

TEST(PngTest, DamagedImagesAreRefused) {
  const std::string data = Encoded({}, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(absl::IsInvalidArgument(PngReader::Open("").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(PngReader::Open("GIF89a and so on").status()));
  int refused = 0;
  for (size_t size = 0; size < data.size(); ++size) {
    const std::string part = data.substr(0, size);
    absl::StatusOr<PngReader> reader = PngReader::Open(part);
    if (!reader.ok()) {
      EXPECT_THAT(std::string(reader.status().message()), HasSubstr("broken PNG: "));
      ++refused;
    }
  }
  EXPECT_GT(refused, 30);  // the signature and the header
  const std::string cut = data.substr(0, 45);
  absl::StatusOr<PngReader> reader = PngReader::Open(cut);
  ASSERT_TRUE(reader.ok()) << reader.status();
  std::vector<uint8_t> rows(6);
  EXPECT_THAT(std::string(reader->ReadRows(rows.data()).message()), HasSubstr("it ends early"));
}

TEST(PngTest, LargerImagesThanTheMaximumAreRefused) {
  const std::string data = Encoded({}, {1, 2, 3, 4, 5, 6});
  EXPECT_TRUE(PngReader::Open(data, 2, 3).ok());
  EXPECT_TRUE(absl::IsInvalidArgument(PngReader::Open(data, 1, 3).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(PngReader::Open(data, 2, 2).status()));
}

TEST(PngTest, WhatIsNoImageCannotBeWritten) {
  EXPECT_TRUE(absl::IsInternal(PngWriter::Begin({.width = 0, .height = 1}).status()));
}

}  // namespace
}  // namespace hypermap
