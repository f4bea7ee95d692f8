#include "client_libs/ros2/conversion/masks.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "client_libs/ros2/conversion/grids.h"
#include "map/grid/cell_cover.h"

namespace hypermap::ros2 {
namespace {

constexpr int8_t kNoZone = 0;
constexpr int8_t kHighest = 100;

// A polygon in the frame of the grid's layer.
struct Zone {
  Polygon area;
  std::optional<double> speed_limit_m_s;
};

std::optional<double> SpeedLimitOf(const SemanticObject& object) {
  const auto it = object.attributes.find(kSpeedLimitAttribute);
  if (it == object.attributes.end()) return std::nullopt;
  if (const auto* const number = std::get_if<double>(&it->second)) return *number;
  if (const auto* const number = std::get_if<int64_t>(&it->second)) {
    return static_cast<double>(*number);
  }
  return std::nullopt;
}

std::vector<Zone> ZonesOf(const Snapshot& snapshot, const GridLayer& like,
                          const ValueQuery& value) {
  constexpr int kItems = 1000;
  std::vector<Zone> zones;
  for (const auto& [name, layer] : snapshot.layers) {
    if (AsSemantic(layer.get()) == nullptr) continue;
    const auto transform = snapshot.frames.Lookup(like.spec().frame_id, layer->spec().frame_id);
    const std::unique_ptr<AnswerCursor> found = layer->Find(value, nullptr);
    if (!transform.ok() || found == nullptr) continue;
    while (!found->done()) {
      for (const ObjectPtr& object : found->Next(kItems).objects) {
        if (!object->shape.is_polygon()) continue;
        zones.push_back({*transform * object->shape.polygon(), SpeedLimitOf(*object)});
      }
    }
  }
  return zones;
}

nav_msgs::OccupancyGrid EmptyGrid(const GridLayer& like, absl::Time stamp) {
  nav_msgs::OccupancyGrid grid;
  grid.header = {ToTime(stamp), like.spec().frame_id};
  grid.info = MetaDataOf(like, stamp);
  grid.data.assign(like.extent().num_cells(), kNoZone);
  return grid;
}

// Calls `set` with the byte of each cell in the zone.
template <typename Set>
void VisitCells(const Zone& zone, const GridLayer& like, nav_msgs::OccupancyGrid* grid, Set set) {
  const CellBox& extent = like.extent();
  const CellCover cover(zone.area, like.geometry(), extent);
  for (int32_t row = cover.bounds().row_begin; row < cover.bounds().row_end; ++row) {
    for (const ColumnSpan& span : cover.SpansOfRow(row)) {
      const int64_t begin = (row - extent.row_begin) * extent.cols() - extent.col_begin;
      for (int32_t col = span.col_begin; col < span.col_end; ++col) set(grid->data[begin + col]);
    }
  }
}

}  // namespace

Mask KeepOutMask(const Snapshot& snapshot, const GridLayer& like, const ValueQuery& value,
                 absl::Time stamp) {
  Mask mask{EmptyGrid(like, stamp), {}};
  mask.info.header = mask.grid.header;
  mask.info.type = nav2_msgs::CostmapFilterInfo::kKeepOut;
  mask.info.multiplier = 1.0F;
  for (const Zone& zone : ZonesOf(snapshot, like, value)) {
    VisitCells(zone, like, &mask.grid, [](int8_t& byte) { byte = kHighest; });
  }
  return mask;
}

Mask SpeedMask(const Snapshot& snapshot, const GridLayer& like, const ValueQuery& value,
               absl::Time stamp) {
  Mask mask{EmptyGrid(like, stamp), {}};
  mask.info.header = mask.grid.header;
  mask.info.type = nav2_msgs::CostmapFilterInfo::kSpeedAbsolute;
  const std::vector<Zone> zones = ZonesOf(snapshot, like, value);
  double highest = 0.0;
  for (const Zone& zone : zones) highest = std::max(highest, zone.speed_limit_m_s.value_or(0.0));
  mask.info.multiplier = static_cast<float>(highest / kHighest);
  for (const Zone& zone : zones) {
    if (!zone.speed_limit_m_s || *zone.speed_limit_m_s <= 0.0) continue;
    // The quotient of a limit that is a whole number of steps may be rounded to less.
    const double steps = std::floor(kHighest * *zone.speed_limit_m_s / highest + 1e-9);
    const auto limit = static_cast<int8_t>(std::clamp(steps, 1.0, double{kHighest}));
    VisitCells(zone, like, &mask.grid,
               [limit](int8_t& byte) { byte = byte == kNoZone ? limit : std::min(byte, limit); });
  }
  return mask;
}

}  // namespace hypermap::ros2
