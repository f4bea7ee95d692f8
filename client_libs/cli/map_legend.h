// The legend of a map's picture.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_MAP_LEGEND_H_
#define HYPERMAP_CLIENT_LIBS_CLI_MAP_LEGEND_H_

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "client_libs/cli/canvas.h"
#include "client_libs/cli/map_scene.h"
#include "client_libs/cli/map_style.h"
#include "map/geometry/point.h"

namespace hypermap::cli {

// Uses as many columns as it needs, up to a limit. Its last line counts the rows that do not fit.
class MapLegend {
 public:
  MapLegend(const MapScene& scene, const RobotColours& robots, const Plan& plan);

  // In pixels.
  double width() const { return static_cast<double>(num_columns()) * column_width_; }
  double height() const;

  void Draw(Canvas& canvas, const Point& top_left) const;

 private:
  using Sample = std::function<void(Canvas& canvas, const Point& at)>;
  struct Row {
    std::string text;
    Sample sample;  // may be empty
  };

  void AddGrid(const GridScene& grid);
  void AddClasses(const std::vector<DrawnObject>& objects);
  void AddExplorations(const MapScene& scene);
  void AddRobots(const std::vector<RobotPath>& paths, const RobotColours& robots);

  void AddText(std::string text);
  void AddSquare(const Colour& c, std::string text);
  void AddGap();
  // Replaces the rows that do not fit by one line with their number.
  void CutShort();

  size_t num_columns() const { return (rows_.size() + rows_per_column_ - 1) / rows_per_column_; }

  std::vector<Row> rows_;
  size_t rows_per_column_ = 0;
  double column_width_ = 0.0;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_MAP_LEGEND_H_
