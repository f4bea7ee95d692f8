#include "map/registration/testing/drawn_plan.h"

#include <utility>
#include <vector>

#include "gtest/gtest.h"
#include "map/layers/layer_registry.h"

namespace hypermap::registration::testing {

std::optional<double> EmptyRoom(const Point& p) {
  if (!Box{{-4.1, -2.6}, {4.1, 2.6}}.Covers(p)) return std::nullopt;
  return Box{{-4.0, -2.5}, {4.0, 2.5}}.Covers(p) ? 0.0 : 1.0;
}

std::optional<double> FurnishedRoom(const Point& p) {
  const bool is_partition = Box{{-1.0, -2.5}, {-0.9, 1.2}}.Covers(p);
  const bool is_cabinet = Box{{2.0, 0.6}, {3.0, 1.4}}.Covers(p);
  return is_partition || is_cabinet ? 1.0 : EmptyRoom(p);
}

std::shared_ptr<const GridLayer> Drawn(const Plan& plan, const PlanarTransform& grid_from_plan,
                                       double resolution_m, double reach_m) {
  const LayerSpec spec{.name = "floor",
                       .kind = LayerKind::kOccupancy,
                       .frame_id = "map",
                       .grid = GridGeometry{.resolution_m = resolution_m}};
  const Box bounds = BoundsOf(grid_from_plan, {{-reach_m, -reach_m}, {reach_m, reach_m}});
  const CellIndex low = *spec.grid->CellAt(bounds.min);
  const CellIndex high = *spec.grid->CellAt(bounds.max);
  const CellBox box{low.row, high.row + 1, low.col, high.col + 1};
  std::vector<std::optional<double>> values;
  for (int32_t row = box.row_begin; row < box.row_end; ++row) {
    for (int32_t col = box.col_begin; col < box.col_end; ++col) {
      values.push_back(plan(grid_from_plan.ApplyInverse(spec.grid->CentreOf({row, col}))));
    }
  }
  GridWriter writer(AsGrid(MakeEmptyLayer(spec)));
  EXPECT_TRUE(writer.Write(box, values).ok());
  return std::move(writer).Finish().layer;
}

}  // namespace hypermap::registration::testing
