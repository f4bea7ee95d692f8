#include "client_libs/cli/point_pairs_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hypermap::cli {
namespace {

using ::testing::HasSubstr;

TEST(ReadPointPairsTest, ReadsNamesCoordinatesAndStandardDeviations) {
  const auto pairs = ReadPointPairs(
      "name,source_x,source_y,target_x,target_y\r\n"
      "north door,1,-2.5,3e1,4\r\n"
      "\n"
      ", 5 , 6 , 7 , 8 , 0.2");
  ASSERT_TRUE(pairs.ok()) << pairs.status();
  ASSERT_EQ(pairs->size(), 2u);
  EXPECT_EQ((*pairs)[0].name, "north door");
  EXPECT_EQ((*pairs)[0].pair.source, (Point{1, -2.5}));
  EXPECT_EQ((*pairs)[0].pair.target, (Point{30, 4}));
  EXPECT_EQ((*pairs)[0].pair.sigma_m, 0.05);
  EXPECT_EQ((*pairs)[1].name, "");
  EXPECT_EQ((*pairs)[1].pair.target, (Point{7, 8}));
  EXPECT_EQ((*pairs)[1].pair.sigma_m, 0.2);
}

TEST(ReadPointPairsTest, WrongLinesAreNamed) {
  for (const std::string line : {"a,1,2,3", "a,1,2,3,4,5,6", "a,1,2,3,x", "a,1,2,3,nan"}) {
    const auto pairs = ReadPointPairs("a,1,2,3,4\n" + line + "\n");
    EXPECT_TRUE(absl::IsInvalidArgument(pairs.status())) << line;
    EXPECT_THAT(pairs.status().message(), HasSubstr("line 2: \"" + line + "\"")) << line;
  }
}

TEST(ReadPointPairsTest, NothingIsNoPairs) { EXPECT_TRUE(ReadPointPairs("\n")->empty()); }

}  // namespace
}  // namespace hypermap::cli
