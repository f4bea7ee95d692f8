#include "simulation/robots/visible_floor.h"

#include <gtest/gtest.h>

#include "simulation/robots/testing/drawn_site.h"

namespace hypermap::robots {
namespace {

// Returns an exploration layer that is explored where the drawing has a '.'.
std::shared_ptr<const GridLayer> Explored(const std::vector<std::string>& lines) {
  LayerSpec spec = DrawnSite(lines)->spec();
  spec.kind = LayerKind::kExploration;
  GridWriter writer(std::make_shared<GridLayer>(spec, MakeCellDomain(spec)));
  for (size_t i = 0; i < lines.size(); ++i) {
    for (size_t col = 0; col < lines[i].size(); ++col) {
      const auto row = static_cast<int32_t>(lines.size() - 1 - i);
      const auto at = static_cast<int32_t>(col);
      const CellBox cell{row, row + 1, at, at + 1};
      EXPECT_TRUE(writer.Write(cell, {lines[i][col] == '.' ? 1.0 : 0.0}).ok());
    }
  }
  return std::move(writer).Finish().layer;
}

TEST(VisibleFloorTest, CountsWhatWasSeenMissedAndHidden) {
  // The room on the right has no door, so that its unexplored cells are hidden; those of the left
  // room are missed.
  const auto site = DrawnSite({"....#..", "....#..", "....#.."});
  const Terrain terrain(*site, Polygon::FromBox({{0, 0}, {7, 3}}), 0.0);
  const auto explored = Explored({"...x#..", "...x#xx", "...x#xx"});
  const VisibleFloor floor = CountVisibleFloor(terrain, explored.get(), {{0, 0}}, 3.0);
  EXPECT_EQ(floor.explored, 9 + 2);
  EXPECT_EQ(floor.missed, 3);
  EXPECT_EQ(floor.hidden, 4);
  EXPECT_DOUBLE_EQ(floor.fraction(), 11.0 / 14.0);
}

TEST(VisibleFloorTest, WithoutAnExplorationLayerNothingIsExplored) {
  const auto site = DrawnSite({"...", "..."});
  const Terrain terrain(*site, Polygon::FromBox({{0, 0}, {2, 2}}), 0.0);
  const VisibleFloor floor = CountVisibleFloor(terrain, nullptr, {{0, 0}}, 3.0);
  EXPECT_EQ(floor.explored, 0);
  EXPECT_EQ(floor.missed, 4) << "of the area alone";
  EXPECT_EQ(VisibleFloor().fraction(), 1.0);
}

}  // namespace
}  // namespace hypermap::robots
