// Summarises the answer of a grid in a few numbers.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_GRID_SUMMARY_H_
#define HYPERMAP_CLIENT_LIBS_CLI_GRID_SUMMARY_H_

#include <cstdint>
#include <string>

#include "client_libs/cli/cell_values.h"
#include "client_libs/cpp/answers.h"
#include "map/geometry/point.h"

namespace hypermap::cli {

// Counts the cells in the parts of one layer, without keeping them. Used by one thread.
class GridSummary {
 public:
  // `first` gives the layer and its geometry, and must have a grid. Its runs are not added.
  explicit GridSummary(const client::LayerPart& first);

  const std::string& layer() const { return layer_; }
  void Add(const CellRun& run);

  int64_t cells() const { return known_ + unknown_; }
  // In square metres.
  double Area() const { return AreaOf(cells()); }
  // The cells' values: "0.02 to 1, mean 0.31; 2.5 m² unknown", or "75 % explored" if cells hold one
  // of two values.
  std::string DescribeValues() const;
  // The box of the cells in the frame of the answer: "(0, 0) to (20, 12)". Empty if there are none.
  std::string DescribeExtent() const;

 private:
  double AreaOf(int64_t cells) const;

  std::string layer_;
  CellValues values_;
  GridGeometry geometry_;
  int64_t known_ = 0;
  int64_t unknown_ = 0;
  double sum_ = 0.0;
  double min_ = 0.0;
  double max_ = 0.0;
  CellBox box_;
};

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_GRID_SUMMARY_H_
