#include "storage/encoding/packed_bytes.h"

#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

TEST(PackedBytesTest, BytesComeBack) {
  for (const std::string& bytes :
       {std::string(), std::string("\0a\xff", 3), std::string(5000, 'x')}) {
    EXPECT_EQ(*UnpackBytes(PackBytes(bytes), static_cast<int64_t>(bytes.size())), bytes);
  }
  EXPECT_LT(PackBytes(std::string(5000, 'x')).size(), 100u);
}

TEST(PackedBytesTest, OtherSizesAndOtherBytesAreDamage) {
  const std::string packed = PackBytes("twelve bytes");
  for (const int64_t size : {int64_t{-1}, int64_t{0}, int64_t{11}, int64_t{13}, int64_t{1} << 40}) {
    EXPECT_EQ(UnpackBytes(packed, size).status().code(), absl::StatusCode::kDataLoss) << size;
  }
  EXPECT_EQ(UnpackBytes(packed.substr(1), 12).status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(UnpackBytes("", 12).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace hypermap::storage
