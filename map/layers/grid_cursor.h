// The answers of a grid in parts. Private to this folder.
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

// Answers with the runs of the cells of a grid, or of those that a polygon covers; of all, or of
// those whose code matches.
class GridCursor : public AnswerCursor {
 public:
  GridCursor(std::shared_ptr<const GridLayer> layer, std::optional<CellCover> cover,
             std::optional<CodePredicate> predicate);

  AnswerPart Next(int max_items) override;
  bool done() const override { return taken_ == pending_.size() && row_ >= box_.row_end; }

 private:
  void TakePending(size_t max_items, std::vector<CellRun>* runs);
  // Adds the runs of the next row. `before`: where in `runs` those of the row before begin.
  void ReadRow(std::optional<size_t> before, std::vector<CellRun>* runs);
  void RepeatRow(size_t before, std::vector<CellRun>* runs);
  // Whether the next row has the cells of the row before, which saves looking at each.
  bool IsLikeTheRowBefore();
  void Append(int32_t begin, int32_t end, CellCode code, std::vector<CellRun>* runs);
  // Asks the memory for the rows up to this one.
  void PrefetchTo(int32_t row_end);

  std::shared_ptr<const GridLayer> layer_;
  std::optional<CellCover> cover_;
  std::optional<CodePredicate> predicate_;
  CellBox box_;
  int32_t row_;
  int32_t prefetched_;  // the rows before this one
  RowReader reader_;
  // Of the rows that were read last and come next, up to spans_end_.
  ColumnSpans spans_;
  int32_t spans_end_;
  // What a row had more than the part had room for, from the taken_-th on.
  std::vector<CellRun> pending_;
  size_t taken_ = 0;
  CellCode last_code_ = kUnknownCode;
};

}  // namespace hypermap

#endif  // HYPERMAP_MAP_LAYERS_GRID_CURSOR_H_
