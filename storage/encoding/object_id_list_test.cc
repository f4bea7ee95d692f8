#include "storage/encoding/object_id_list.h"

#include <limits>

#include "gtest/gtest.h"

namespace hypermap::storage {
namespace {

TEST(ObjectIdListTest, ListsComeBack) {
  using Int = std::numeric_limits<int64_t>;
  for (const std::vector<ObjectId>& ids : {std::vector<ObjectId>{},
                                           {0},
                                           {0, 0, 1, 2, 3, 0},
                                           {Int::max(), 0, Int::max(), 1},
                                           {Int::min(), Int::max(), -1, 1}}) {
    EXPECT_EQ(*DecodeObjectIds(EncodeObjectIds(ids)), ids);
  }
}

TEST(ObjectIdListTest, NewObjectsTakeAByteEach) {
  std::vector<ObjectId> ids(1000);
  for (int i = 0; i < 1000; ++i) ids[i] = 1'000'000 + i;
  EXPECT_LT(EncodeObjectIds(ids).size(), 1010u);
}

TEST(ObjectIdListTest, OtherBytesAreDamage) {
  EXPECT_EQ(DecodeObjectIds("\x80").status().code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(DecodeObjectIds(std::string(11, '\x80')).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace hypermap::storage
