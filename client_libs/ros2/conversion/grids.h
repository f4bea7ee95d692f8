// Grid layers as the grids of ROS.
#ifndef HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_GRIDS_H_
#define HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_GRIDS_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/time/time.h"
#include "client_libs/ros2/messages/messages.h"
#include "map/layers/grid_layer.h"

namespace hypermap::ros2 {

// How probabilities between free and occupied are told, as nav2's map_server names it.
enum class GridMode {
  kTrinary,  // unknown
  kScale,    // 1 to 99, evenly from the one threshold to the other
};

inline constexpr int8_t kUnknownByte = -1;

builtin_interfaces::Time ToTime(absl::Time time);

// Tells the values of a layer's cells as bytes of an OccupancyGrid: -1 is unknown. Occupancy: 0 is
// free and 100 occupied, by the layer's thresholds. Exploration: 100 is explored, 0 not. Scalar: 0
// to 100, evenly from the least value of the layer to the greatest.
class CellBytes {
 public:
  // Looks at all cells of a scalar layer, unless its kind bounds the values. `layer` must outlive
  // this.
  CellBytes(const GridLayer& layer, GridMode mode);
  int8_t operator()(CellCode code) const;

 private:
  const GridLayer& layer_;
  const GridMode mode_;
  CellValueRange range_;
};

// The byte of a known cell of an occupancy or exploration layer.
int8_t ByteOf(const LayerSpec& spec, double value, GridMode mode);

// The extent of a layer. The origin is its lower left corner, and may be turned.
nav_msgs::MapMetaData MetaDataOf(const GridLayer& layer, absl::Time stamp);

// The whole layer. Its frame is the layer's.
nav_msgs::OccupancyGrid ToOccupancyGrid(const GridLayer& layer, GridMode mode, absl::Time stamp);

// The cells of `box`, which must lie in the extent.
map_msgs::OccupancyGridUpdate ToUpdate(const GridLayer& layer, const CellBox& box, GridMode mode,
                                       absl::Time stamp);

// The smallest box of all cells that differ between two versions of a layer; empty if none does.
// The extents and geometries must be the same.
CellBox ChangedCells(const GridLayer& before, const GridLayer& after);

// Whether an update can turn the grid of `before` into that of `after`: both have the same cells,
// in the same place, and unchanged cells have the same bytes.
bool CanUpdate(const GridLayer& before, const GridLayer& after);

}  // namespace hypermap::ros2

#endif  // HYPERMAP_CLIENT_LIBS_ROS2_CONVERSION_GRIDS_H_
