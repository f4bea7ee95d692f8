#include "client_libs/cli/point_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace hypermap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(PointLinesTest, TakesWhatPeopleAndProgramsWrite) {
  std::istringstream in("x,y\r\n1 2\n\n-0.5,1e3\r\n\t3\t,  4 \n5;6");
  PointLines lines(in);
  EXPECT_THAT(lines.Next(9), ElementsAre(Point{1, 2}, Point{-0.5, 1000}, Point{3, 4}, Point{5, 6}));
  EXPECT_THAT(lines.Next(9), IsEmpty());
  EXPECT_TRUE(lines.status().ok());
}

TEST(PointLinesTest, GivesNoMoreThanWanted) {
  std::istringstream in("1 2\n3 4\n5 6\n");
  PointLines lines(in);
  EXPECT_THAT(lines.Next(2), ElementsAre(Point{1, 2}, Point{3, 4}));
  EXPECT_THAT(lines.Next(2), ElementsAre(Point{5, 6}));
  EXPECT_THAT(lines.Next(2), IsEmpty());
}

TEST(PointLinesTest, NamesTheFirstLineThatIsWrongAfterThePointsBeforeIt) {
  for (const char* wrong : {"1", "1 2 3", "a b", "1 nan", "1 inf", "x y"}) {
    SCOPED_TRACE(wrong);
    std::istringstream in(std::string("1 2\n\n") + wrong + "\n3 4\n");
    PointLines lines(in);
    EXPECT_THAT(lines.Next(9), ElementsAre(Point{1, 2}));
    EXPECT_THAT(lines.Next(9), IsEmpty());
    EXPECT_EQ(lines.status(), absl::InvalidArgumentError(std::string("line 3: \"") + wrong +
                                                         "\" is not of the form X Y"));
  }
}

}  // namespace
}  // namespace hypermap::cli
