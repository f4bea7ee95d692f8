#include "client_libs/cli/cell_values.h"

#include <gtest/gtest.h>

namespace hypermap::cli {
namespace {

TEST(CellValuesTest, BinaryCellsAreWordsAndOthersNumbers) {
  const CellValues seen(LayerKind::kExploration);
  EXPECT_EQ(seen.Describe(1.0), "explored");
  EXPECT_EQ(seen.Describe(0.0), "unexplored");
  EXPECT_EQ(CellValues(LayerKind::kOccupancy).Describe(0.02), "0.02");
  EXPECT_EQ(CellValues(LayerKind::kScalar).Describe(-67.25), "-67.25");
}

TEST(CellValuesTest, WordsAreThoseThatAQuestionWouldFindTheValueBy) {
  LayerSpec spec;
  spec.kind = LayerKind::kOccupancy;
  spec.thresholds.free_below = 0.4;
  const CellValues floor(spec, PropertiesOf(spec));
  EXPECT_EQ(floor.Word(0.3), "free");
  EXPECT_EQ(CellValues(LayerKind::kOccupancy).Word(0.3), "") << "neither free nor occupied";
  EXPECT_EQ(floor.Word(1.0), "occupied");
  EXPECT_EQ(floor.Word(7.0), "") << "no probability";
  EXPECT_EQ(CellValues(LayerKind::kScalar).Word(7.0), "");
  EXPECT_EQ(CellValues(LayerKind::kSemantic).Word(1.0), "");
}

TEST(CellValuesTest, APropertyDecidesAndNotTheKind) {
  LayerSpec spec;
  spec.kind = LayerKind::kScalar;
  LayerProperties properties = PropertiesOf(spec);
  properties.is_binary = true;
  EXPECT_EQ(CellValues(spec, properties).Describe(3.0), "3") << "a bit that has no word";
  properties.words_of_values = {{"quiet", 0.0}, {"loud", 3.0}};
  EXPECT_EQ(CellValues(spec, properties).Describe(3.0), "loud");
  EXPECT_EQ(CellValues(spec, properties).Describe(0.0), "quiet");
}

}  // namespace
}  // namespace hypermap::cli
