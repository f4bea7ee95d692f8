#include "wire/file_format.h"

#include <gtest/gtest.h>

namespace hypermap::wire {
namespace {

TEST(FileFormatTest, ComesBackEqual) {
  for (const FileFormat format : {FileFormat::kHmap, FileFormat::kNav2, FileFormat::kGeoJson}) {
    EXPECT_EQ(*DecodeFileFormat("format", EncodeFileFormat(format)), format);
  }
  EXPECT_EQ(EncodeFileFormat(FileFormat::kNav2), v1::FILE_FORMAT_NAV2);
}

TEST(FileFormatTest, BadOnesNameTheField) {
  EXPECT_EQ(DecodeFileFormat("format", v1::FILE_FORMAT_UNSPECIFIED).status(),
            absl::InvalidArgumentError("format is missing"));
  EXPECT_EQ(DecodeFileFormat("format", static_cast<v1::FileFormat>(77)).status(),
            absl::InvalidArgumentError("format is not known: 77"));
}

TEST(FileFormatTest, EachFormatOfMessagesIsKnown) {
  for (int i = v1::FileFormat_MIN + 1; i <= v1::FileFormat_MAX; ++i) {
    EXPECT_TRUE(DecodeFileFormat("format", static_cast<v1::FileFormat>(i)).ok()) << i;
  }
}

}  // namespace
}  // namespace hypermap::wire
