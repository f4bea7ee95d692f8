#include "map/watch/cell_changes.h"

#include <algorithm>

namespace hypermap {
namespace {

// Collects cells, given by row and column, as runs of equal values.
class Runs {
 public:
  Runs(const CellDomain& domain, std::vector<CellRun>* runs) : domain_(domain), runs_(*runs) {}

  void Add(int32_t row, int32_t col, CellCode code) {
    if (!runs_.empty() && runs_.back().row == row && runs_.back().col_end == col &&
        SameCode(last_, code)) {
      ++runs_.back().col_end;
      return;
    }
    last_ = code;
    std::optional<double> value;
    if (!IsUnknown(code)) value = domain_.Decode(code);
    runs_.push_back({row, col, col + 1, value});
  }

 private:
  const CellDomain& domain_;
  std::vector<CellRun>& runs_;
  CellCode last_ = kUnknownCode;
};

}  // namespace

CellChanges ChangedCells(const TileIndex& index, const Tile* before, const Tile* after,
                         const CellDomain& domain, const CellCover* cover) {
  const CellBox cells = CellsOf(index);
  const auto code_in = [&cells](const Tile* tile, int32_t row, int32_t col) {
    return tile ? tile->at(row - cells.row_begin, col - cells.col_begin) : kUnknownCode;
  };
  CellChanges changes;
  Runs old_runs(domain, &changes.before);
  Runs new_runs(domain, &changes.after);
  for (int32_t row = cells.row_begin; row < cells.row_end; ++row) {
    const ColumnSpans spans =
        cover ? cover->SpansOfRow(row) : ColumnSpans{{cells.col_begin, cells.col_end}};
    for (const ColumnSpan& span : spans) {
      const int32_t begin = std::max(span.col_begin, cells.col_begin);
      const int32_t end = std::min(span.col_end, cells.col_end);
      for (int32_t col = begin; col < end; ++col) {
        const CellCode was = code_in(before, row, col);
        const CellCode is = code_in(after, row, col);
        if (SameCode(was, is)) continue;
        old_runs.Add(row, col, was);
        new_runs.Add(row, col, is);
      }
    }
  }
  return changes;
}

}  // namespace hypermap
