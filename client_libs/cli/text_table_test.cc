#include "client_libs/cli/text_table.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>

namespace hypermap::cli {
namespace {

TEST(TextTableTest, NumbersAreAlignedToTheRightAndWordsToTheLeft) {
  TextTable table({"NAME", "N"});
  table.AddRow({"a", "5"});
  table.AddRow({"bb", "-17"});
  std::ostringstream out;
  table.Print(out);
  EXPECT_EQ(out.str(), "NAME    N\na       5\nbb    -17\n");
}

TEST(TextTableTest, WidthIsInCharactersAndARowIsALine) {
  TextTable table({"LABEL", "X"});
  table.AddRow({"Küche\n", "a"});
  table.AddRow({"Spüle II", "b"});
  std::ostringstream out;
  table.Print(out);
  EXPECT_EQ(out.str(), "LABEL     X\nKüche     a\nSpüle II  b\n");
}

TEST(FormatNumberTest, HasNoTrailingZerosAndNoNegativeZero) {
  EXPECT_EQ(FormatNumber(2.5), "2.5");
  EXPECT_EQ(FormatNumber(-100), "-100");
  EXPECT_EQ(FormatNumber(0.12345), "0.123");
  EXPECT_EQ(FormatNumber(-0.0001), "0");
  EXPECT_EQ(FormatNumber(70, 0), "70");
  EXPECT_EQ(FormatNumber(std::numeric_limits<double>::infinity()), "inf");
}

}  // namespace
}  // namespace hypermap::cli
