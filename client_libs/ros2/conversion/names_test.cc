#include "client_libs/ros2/conversion/names.h"

#include <gtest/gtest.h>

#include "tests/support/random_map.h"

namespace hypermap::ros2 {
namespace {

LayerSpec Grid(const std::string& name, LayerKind kind) {
  LayerSpec spec;
  spec.name = name;
  spec.kind = kind;
  spec.grid = GridGeometry{{}, 0.5};
  return spec;
}

TEST(NamesTest, HaveOnlyCharactersThatRosKnows) {
  EXPECT_EQ(NameInRos("office_2"), "office_2");
  EXPECT_EQ(NameInRos("2nd-floor.east"), "_2nd_floor_east");
  EXPECT_EQ(GridTopicOf("wifi-5"), "grids/wifi_5");
  EXPECT_EQ(SemanticTopicOf("the.things"), "the_things_semmap");
}

TEST(NamesTest, TheMapIsTheNamedOrTheFirstOccupancyLayer) {
  const Snapshot map =
      testing::MakeSnapshot("site", {{CreateLayer{Grid("b", LayerKind::kOccupancy)},
                                      CreateLayer{Grid("c", LayerKind::kOccupancy)},
                                      CreateLayer{Grid("a", LayerKind::kExploration)}}});
  EXPECT_EQ(OccupancyLayerOf(map, "")->spec().name, "b");
  EXPECT_EQ(OccupancyLayerOf(map, "c")->spec().name, "c");
  EXPECT_EQ(OccupancyLayerOf(map, "a"), nullptr);
  EXPECT_EQ(OccupancyLayerOf(map, "d"), nullptr);
}

}  // namespace
}  // namespace hypermap::ros2
