// Reads answers of a grid in parts. Private to this folder.
#ifndef HYPERMAP_MAP_LAYERS_GRID_CURSOR_H_
#define HYPERMAP_MAP_LAYERS_GRID_CURSOR_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "map/grid/cell_cover.h"
#include "map/grid/cell_domain.h"
#include "map/layers/grid_layer.h"
#include "map/layers/layer.h"
#include "map/layers/row_reader.h"

namespace hypermap {

// Returns the runs of a grid's cells, or of those that a polygon covers; all of them, or those
// whose codes match a predicate.
class GridCursor : public AnswerCursor {
 public:
  GridCursor(std::shared_ptr<const GridLayer> layer, std::optional<CellCover> cover,
             std::optional<CodePredicate> predicate);

  AnswerPart Next(int max_items) override;
  bool done() const override { return taken_ == pending_.size() && row_ >= box_.row_end; }

 private:
  void TakePending(size_t max_items, std::vector<CellRun>* runs);
  // Adds the runs of the next row. `before` is the index in `runs` at which those of the row before
  // begin.
  void ReadRow(std::optional<size_t> before, std::vector<CellRun>* runs);
  void RepeatRow(size_t before, std::vector<CellRun>* runs);
  // Returns whether the next row equals the row before, so that its runs can be copied without
  // reading cells.
  bool IsLikeTheRowBefore();
  void Append(int32_t begin, int32_t end, CellCode code, std::vector<CellRun>* runs);
  // Prefetches the cells of the rows before `row_end`.
  void PrefetchTo(int32_t row_end);

  std::shared_ptr<const GridLayer> layer_;
  std::optional<CellCover> cover_;
  std::optional<CodePredicate> predicate_;
  CellBox box_;
  int32_t row_;
  int32_t prefetched_;  // Rows before this one are prefetched.
  RowReader reader_;
  // Columns of the rows from the one read last up to spans_end_; all of these rows have the same
  // ones.
  ColumnSpans spans_;
  int32_t spans_end_;
  // Runs of the last row that did not fit into the part; those from `taken_` on are still to be
  // returned.
  std::vector<CellRun> pending_;
  size_t taken_ = 0;
  CellCode last_code_ = kUnknownCode;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_CURSOR_H_
