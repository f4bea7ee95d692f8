#include "map/grid/column_span.h"

#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/support/random_map.h"

namespace hypermap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::Rng;
using testing::TestSeed;
using testing::UniformInt;

TEST(ColumnSpanTest, UnionJoinsWhatOverlapsOrAdjoins) {
  EXPECT_THAT(Union({{5, 7}, {1, 3}, {3, 4}, {6, 9}, {12, 12}, {20, 10}}),
              ElementsAre(ColumnSpan{1, 4}, ColumnSpan{5, 9}));
  EXPECT_THAT(Union({}), IsEmpty());
}

TEST(ColumnSpanTest, DifferenceCutsOut) {
  EXPECT_THAT(Difference({{0, 10}, {20, 30}}, {{-5, 1}, {4, 5}, {9, 21}, {30, 40}}),
              ElementsAre(ColumnSpan{1, 4}, ColumnSpan{5, 9}, ColumnSpan{21, 30}));
  EXPECT_THAT(Difference({{0, 10}}, {{0, 10}}), IsEmpty());
}

constexpr int kColumns = 40;

std::vector<bool> Expand(const ColumnSpans& spans) {
  std::vector<bool> columns(kColumns);
  for (const ColumnSpan& span : spans) {
    for (int32_t col = span.col_begin; col < span.col_end; ++col) columns[col] = true;
  }
  return columns;
}

void ExpectSortedAndApart(const ColumnSpans& spans) {
  for (size_t i = 0; i < spans.size(); ++i) {
    EXPECT_LT(spans[i].col_begin, spans[i].col_end);
    if (i > 0) {
      EXPECT_LT(spans[i - 1].col_end, spans[i].col_begin);
    }
  }
}

TEST(ColumnSpanTest, AgreesWithSetsOfColumns) {
  const uint64_t seed = TestSeed();
  SCOPED_TRACE("HYPERMAP_TEST_SEED=" + std::to_string(seed));
  Rng rng(seed);
  const auto random_spans = [&] {
    ColumnSpans spans(UniformInt(rng, 0, 6));
    for (ColumnSpan& span : spans) {
      span.col_begin = UniformInt(rng, 0, kColumns);
      span.col_end = UniformInt(rng, span.col_begin, std::min(kColumns, span.col_begin + 9));
    }
    return spans;
  };
  for (int i = 0; i < 2000; ++i) {
    const auto a = random_spans(), b = random_spans();
    const auto united = Union(a), left = Difference(Union(a), Union(b));
    ExpectSortedAndApart(united);
    ExpectSortedAndApart(left);
    EXPECT_EQ(Expand(united), Expand(a));
    std::vector<bool> expected = Expand(a);
    const std::vector<bool> without = Expand(b);
    for (int col = 0; col < kColumns; ++col) expected[col] = expected[col] && !without[col];
    EXPECT_EQ(Expand(left), expected);
  }
}

}  // namespace
}  // namespace hypermap
