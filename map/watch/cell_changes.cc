#include "map/watch/cell_changes.h"

#include <algorithm>
#include <utility>

namespace hypermap {

TileComparison::TileComparison(const TileIndex& index, const Tile* before, const Tile* after,
                               const CellDomain* domain, const CellBox& within)
    : index_(index),
      before_(before),
      after_(after),
      domain_(domain),
      box_(CellsOf(index).Intersection(within)),
      row_(box_.row_begin) {}

void TileComparison::Runs::Add(int32_t row, int32_t col, CellCode code, const CellDomain& domain) {
  if (!runs.empty() && runs.back().row == row && runs.back().col_end == col &&
      SameCode(last, code)) {
    ++runs.back().col_end;
    return;
  }
  last = code;
  std::optional<double> value;
  if (!IsUnknown(code)) value = domain.Decode(code);
  runs.push_back({row, col, col + 1, value});
}

CellCode TileComparison::CodeIn(const Tile* tile, int32_t col) const {
  return tile ? tile->at(row_ - index_.row * kTileSide, col - index_.col * kTileSide)
              : kUnknownCode;
}

void TileComparison::CompareRow(const ColumnSpans& spans) {
  // An area may have thousands of spans left of the tile.
  auto span = std::partition_point(spans.begin(), spans.end(), [this](const ColumnSpan& left) {
    return left.col_end <= box_.col_begin;
  });
  for (; span != spans.end() && span->col_begin < box_.col_end; ++span) {
    const int32_t end = std::min(span->col_end, box_.col_end);
    for (int32_t col = std::max(span->col_begin, box_.col_begin); col < end; ++col) {
      const CellCode was = CodeIn(before_, col);
      const CellCode is = CodeIn(after_, col);
      if (SameCode(was, is)) continue;
      runs_before_.Add(row_, col, was, *domain_);
      runs_after_.Add(row_, col, is, *domain_);
    }
  }
  ++row_;
}

CellChanges TileComparison::Take() && {
  return {std::move(runs_after_.runs), std::move(runs_before_.runs)};
}

CellChanges ChangedCells(const TileIndex& index, const Tile* before, const Tile* after,
                         const CellDomain& domain) {
  const CellBox cells = CellsOf(index);
  TileComparison tile(index, before, after, &domain);
  while (!tile.done()) tile.CompareRow({{cells.col_begin, cells.col_end}});
  return std::move(tile).Take();
}

}  // namespace hypermap
