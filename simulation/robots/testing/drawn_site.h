// Occupancy layers for tests, drawn in ASCII.
#ifndef HYPERMAP_SIMULATION_ROBOTS_TESTING_DRAWN_SITE_H_
#define HYPERMAP_SIMULATION_ROBOTS_TESTING_DRAWN_SITE_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "map/edits/edit.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer_registry.h"

namespace hypermap::robots {

// Size of the cells of the drawings below.
inline constexpr double kResolution_m = 0.5;
inline const std::vector<std::string> kRoom = {"############",  //
                                               "#..........#",  //
                                               "#..........#",  //
                                               "#..........#",  //
                                               "############"};

inline LayerSpec DrawnSpec(double resolution_m) {
  LayerSpec spec;
  spec.name = "occupancy";
  spec.kind = LayerKind::kOccupancy;
  spec.frame_id = "map";
  spec.grid = GridGeometry{{}, resolution_m};
  return spec;
}

// Returns the cells of a drawing: '#' is occupied, '?' unknown, and all other characters are free.
// The first line is the top row. The lower left corner is the origin.
inline WriteCells DrawnCells(const std::vector<std::string>& lines) {
  WriteCells write{
      "occupancy",
      {0, static_cast<int32_t>(lines.size()), 0, static_cast<int32_t>(lines.front().size())},
      {}};
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) {
    for (const char c : *line) {
      write.values.push_back(c == '?' ? std::nullopt : std::optional<double>(c == '#' ? 1.0 : 0.0));
    }
  }
  return write;
}

inline std::shared_ptr<const GridLayer> DrawnSite(const std::vector<std::string>& lines,
                                                  double resolution_m = 1.0) {
  const LayerSpec spec = DrawnSpec(resolution_m);
  GridWriter writer(std::make_shared<GridLayer>(spec, MakeCellDomain(spec)));
  const WriteCells cells = DrawnCells(lines);
  if (!writer.Write(cells.box, cells.values).ok()) return nullptr;
  return std::move(writer).Finish().layer;
}

}  // namespace hypermap::robots

#endif  // HYPERMAP_SIMULATION_ROBOTS_TESTING_DRAWN_SITE_H_
