#include "map/values/value_query.h"

#include <limits>
#include <string>
#include <utility>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/not_finite.h"

namespace hypermap {
namespace {

using ::testing::HasSubstr;

using hypermap::testing::kInf;

TEST(ValueQueryTest, UnderstandsWhatCallersWrite) {
  const std::pair<const char*, ValueQuery> table[] = {
      {"free", ValueKeyword::kFree},
      {"Occupied", ValueKeyword::kOccupied},
      {" UNKNOWN\t", ValueKeyword::kUnknown},
      {"explored", ValueKeyword::kExplored},
      {"unExplored", ValueKeyword::kUnexplored},

      {">0.65", ValueRange{0.65, kInf, true, false}},
      {"> 0.65", ValueRange{0.65, kInf, true, false}},
      {">=0.65", ValueRange{0.65, kInf, false, false}},
      {" >= 0.2 ", ValueRange{0.2, kInf, false, false}},
      {"<0.2", ValueRange{-kInf, 0.2, false, true}},
      {"<=0.2", ValueRange{-kInf, 0.2, false, false}},
      {"<= -70", ValueRange{-kInf, -70, false, false}},
      {"=1", ValueRange{1, 1, false, false}},
      {"= -1.5e2", ValueRange{-150, -150, false, false}},
      {"0.2..0.5", ValueRange{0.2, 0.5, false, false}},
      {"0.2 .. 0.5", ValueRange{0.2, 0.5, false, false}},
      {"-70..-50", ValueRange{-70, -50, false, false}},
      {"-.5...5", ValueRange{-0.5, 0.5, false, false}},
      {"3..3", ValueRange{3, 3, false, false}},

      {"chair", ValueLabel{"chair"}},
      {"  Dining   Table ", ValueLabel{"dining table"}},
      {"dining\n\ttable", ValueLabel{"dining table"}},
      {"3d printer", ValueLabel{"3d printer"}},
      {"0.5", ValueLabel{"0.5"}},
      {"free space", ValueLabel{"free space"}},
      {"and..so", ValueLabel{"and..so"}},
      {"...", ValueLabel{"..."}},
      {"T\xC3\xBCR", ValueLabel{"t\xC3\xBCr"}},

      {"tag:furniture", ValueTag{"furniture"}},
      {"tag: furniture", ValueTag{"furniture"}},
      {"TAG:  Soft  Furniture ", ValueTag{"soft furniture"}},
      {"tag:>0.5", ValueTag{">0.5"}},
      {"tag:free", ValueTag{"free"}},
      {"price tag:5", ValueLabel{"price tag:5"}},
  };
  for (const auto& [text, expected] : table) {
    const auto query = ParseValueQuery(text);
    ASSERT_TRUE(query.ok()) << "'" << text << "': " << query.status();
    EXPECT_EQ(*query, expected) << "'" << text << "'";
  }
}

TEST(ValueQueryTest, RefusesWhatMeansNothing) {
  const std::pair<const char*, const char*> table[] = {
      {"", "must not be empty"},
      {" \t ", "must not be empty"},
      {">", "finite number"},
      {">=", "finite number"},
      {">nan", "finite number"},
      {"<inf", "finite number"},
      {"=-inf", "finite number"},
      {">1e400", "finite number"},
      {">0.5x", "finite number"},
      {"> 0.5 0.6", "finite number"},
      {"=>1", "finite number"},
      {"==1", "finite number"},
      {"<>1", "finite number"},
      {">chair", "finite number"},
      {"..", "two finite numbers"},
      {"0.2..", "two finite numbers"},
      {"..0.5", "two finite numbers"},
      {"0.2..nan", "two finite numbers"},
      {"1..1e400", "two finite numbers"},
      {"0.2..chair", "two finite numbers"},
      {"0.5..0.2", "ends before it begins"},
      {"-50..-70", "ends before it begins"},
      {"tag:", "tag must not be empty"},
      {"tag:  ", "tag must not be empty"},
  };
  for (const auto& [text, message] : table) {
    const auto query = ParseValueQuery(text);
    ASSERT_FALSE(query.ok()) << "'" << text << "'";
    EXPECT_EQ(query.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(query.status().message()), HasSubstr(message)) << "'" << text << "'";
  }
}

TEST(ValueQueryTest, ANumberThatDoublesDoNotReachIsALabelUnlessCompared) {
  EXPECT_EQ(*ParseValueQuery("1e400"), ValueQuery(ValueLabel{"1e400"}));
}

TEST(ValueRangeTest, ContainsItsClosedEndsOnly) {
  const ValueRange closed{0.2, 0.5, false, false};
  EXPECT_TRUE(closed.Contains(0.2));
  EXPECT_TRUE(closed.Contains(0.5));
  EXPECT_FALSE(closed.Contains(0.51));
  const ValueRange open{0.2, 0.5, true, true};
  EXPECT_FALSE(open.Contains(0.2));
  EXPECT_FALSE(open.Contains(0.5));
  EXPECT_TRUE(open.Contains(0.3));
  EXPECT_FALSE(ValueRange().Contains(std::numeric_limits<double>::quiet_NaN()));
}

}  // namespace
}  // namespace hypermap
