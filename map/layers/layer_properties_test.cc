#include "map/layers/layer_properties.h"

#include <memory>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"
#include "map/values/value_query.h"

namespace hypermap {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;

LayerSpec SpecOf(LayerKind kind) {
  LayerSpec spec{.name = "layer", .kind = kind, .frame_id = "map"};
  if (IsGridKind(kind)) spec.grid = GridGeometry{PlanarTransform(), 0.5};
  if (kind == LayerKind::kScalar) spec.unit = "dBm";
  return spec;
}

constexpr LayerKind kGridKinds[] = {LayerKind::kOccupancy, LayerKind::kExploration,
                                    LayerKind::kScalar};

TEST(LayerPropertiesTest, LayerOfObjectsHasShapesAndNoCells) {
  const LayerProperties properties = PropertiesOf(SpecOf(LayerKind::kSemantic));
  EXPECT_TRUE(properties.has_shapes);
  EXPECT_FALSE(properties.has_cells);
  EXPECT_FALSE(properties.value_range.has_value());
  EXPECT_THAT(properties.words, IsEmpty());
}

TEST(LayerPropertiesTest, GridHasCellsAndNoShapes) {
  for (const LayerKind kind : kGridKinds) {
    const LayerProperties properties = PropertiesOf(SpecOf(kind));
    EXPECT_TRUE(properties.has_cells) << LayerKindName(kind);
    EXPECT_FALSE(properties.has_shapes) << LayerKindName(kind);
  }
  EXPECT_EQ(PropertiesOf(SpecOf(LayerKind::kScalar)).unit, "dBm");
}

TEST(LayerPropertiesTest, WordsAreThoseThatTheLayerTakes) {
  for (const LayerKind kind : kGridKinds) {
    const LayerSpec spec = SpecOf(kind);
    const LayerProperties properties = PropertiesOf(spec);
    const std::shared_ptr<const CellDomain> domain = MakeCellDomain(spec);
    for (const std::string word : {"free", "occupied", "unknown", "explored", "unexplored"}) {
      SCOPED_TRACE(std::string(LayerKindName(kind)) + " " + word);
      if (domain->Match(*ParseValueQuery(word)).has_value()) {
        EXPECT_THAT(properties.words, Contains(word));
      } else {
        EXPECT_THAT(properties.words, ::testing::Not(Contains(word)));
      }
    }
  }
}

TEST(LayerPropertiesTest, WordsOfValuesMatchTheirValueAlone) {
  for (const LayerKind kind : kGridKinds) {
    const LayerSpec spec = SpecOf(kind);
    const LayerProperties properties = PropertiesOf(spec);
    const std::shared_ptr<const CellDomain> domain = MakeCellDomain(spec);
    if (properties.is_binary) EXPECT_EQ(properties.words_of_values.size(), 2u);
    for (const WordOfValue& named : properties.words_of_values) {
      SCOPED_TRACE(named.word);
      EXPECT_THAT(properties.words, Contains(named.word));
      const auto matches = domain->Match(*ParseValueQuery(named.word));
      ASSERT_TRUE(matches.has_value());
      for (const double value : {0.0, 0.5, 1.0}) {
        const auto code = domain->Encode(value);
        if (code.ok()) EXPECT_EQ((*matches)(*code), value == named.value) << value;
      }
    }
  }
  EXPECT_THAT(PropertiesOf(SpecOf(LayerKind::kOccupancy)).words_of_values, IsEmpty());
}

TEST(LayerPropertiesTest, ValueRangeIsThatOfTheCells) {
  for (const LayerKind kind : kGridKinds) {
    SCOPED_TRACE(LayerKindName(kind).data());
    const LayerSpec spec = SpecOf(kind);
    const LayerProperties properties = PropertiesOf(spec);
    const std::shared_ptr<const CellDomain> domain = MakeCellDomain(spec);
    const CellValueRange range = properties.value_range.value_or(CellValueRange{-1e6, 1e6});
    EXPECT_TRUE(domain->Encode(range.min).ok());
    EXPECT_TRUE(domain->Encode(range.max).ok());
    // A binary layer has no value between its two.
    EXPECT_EQ(domain->Encode((range.min + range.max) / 2).ok(), !properties.is_binary);
    EXPECT_EQ(domain->Encode(range.min - 1).ok(), !properties.value_range.has_value());
    EXPECT_EQ(domain->Encode(range.max + 1).ok(), !properties.value_range.has_value());
  }
}

}  // namespace
}  // namespace hypermap
