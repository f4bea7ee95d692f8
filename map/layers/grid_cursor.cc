#include "map/layers/grid_cursor.h"

#include <algorithm>
#include <utility>

#include "base/cancellation/cancellation.h"

namespace hypermap {
namespace {

// Approximate number of cells that a part reads at most, so that the caller can check for
// cancellation.
constexpr int64_t kCellsPerPart = int64_t{1} << 20;

// The hardware prefetcher does not follow rows, which lie far apart in memory. So many rows are
// prefetched ahead, unless rows are longer than kPrefetchedColumns.
constexpr int32_t kRowsAhead = 24;
constexpr int32_t kPrefetchedColumns = 256;

}  // namespace

GridCursor::GridCursor(std::shared_ptr<const GridLayer> layer, std::optional<CellCover> cover,
                       std::optional<CodePredicate> predicate)
    : layer_(std::move(layer)),
      cover_(std::move(cover)),
      predicate_(std::move(predicate)),
      box_(cover_ ? cover_->bounds() : layer_->extent()),
      row_(box_.empty() ? box_.row_end : box_.row_begin),
      prefetched_(box_.cols() <= kPrefetchedColumns ? row_ : box_.row_end),
      reader_(layer_->tiles()),
      spans_end_(row_) {
  PrefetchTo(row_ + kRowsAhead);
}

AnswerPart GridCursor::Next(int max_items) {
  const auto max_runs = static_cast<size_t>(max_items);
  AnswerPart part;
  std::vector<CellRun>& runs = part.runs;
  // Most areas have a few runs per row.
  constexpr int64_t kLikely = 256;
  runs.reserve(std::min({int64_t{max_items}, 4 * (int64_t{box_.row_end} - row_), kLikely}));
  TakePending(max_runs, &runs);
  std::optional<size_t> before;
  for (int64_t work = 0; row_ < box_.row_end && runs.size() < max_runs && work < kCellsPerPart;
       work += box_.cols() + kTileSide) {
    if (IsCancelled()) break;
    const size_t begin = runs.size();
    ReadRow(before, &runs);
    before = begin;
  }
  if (runs.size() > max_runs) {
    pending_.assign(runs.begin() + max_items, runs.end());
    taken_ = 0;
    runs.resize(max_runs);
  }
  return part;
}

void GridCursor::TakePending(size_t max_items, std::vector<CellRun>* runs) {
  const size_t count = std::min(max_items, pending_.size() - taken_);
  const auto first = pending_.begin() + static_cast<ptrdiff_t>(taken_);
  runs->insert(runs->end(), first, first + static_cast<ptrdiff_t>(count));
  taken_ += count;
}

void GridCursor::ReadRow(std::optional<size_t> before, std::vector<CellRun>* runs) {
  PrefetchTo(row_ + 1 + kRowsAhead);
  if (row_ < spans_end_ && before && IsLikeTheRowBefore()) {
    RepeatRow(*before, runs);
  } else {
    if (row_ >= spans_end_) {
      spans_ = cover_ ? cover_->SpansOfRow(row_) : ColumnSpans{{box_.col_begin, box_.col_end}};
      spans_end_ = cover_ ? cover_->EndOfLikeRows(row_) : box_.row_end;
    }
    for (const ColumnSpan& span : spans_) {
      reader_.Visit(row_, span, [&](int32_t begin, int32_t end, CellCode code) {
        if (!predicate_ || (*predicate_)(code)) Append(begin, end, code, runs);
      });
    }
  }
  ++row_;
}

bool GridCursor::IsLikeTheRowBefore() {
  return std::all_of(spans_.begin(), spans_.end(), [this](const ColumnSpan& span) {
    return reader_.IsLikeTheRowBefore(row_, span);
  });
}

void GridCursor::RepeatRow(size_t before, std::vector<CellRun>* runs) {
  const size_t end = runs->size();
  for (size_t i = before; i < end; ++i) {
    runs->push_back((*runs)[i]);
    runs->back().row = row_;
  }
}

void GridCursor::Append(int32_t begin, int32_t end, CellCode code, std::vector<CellRun>* runs) {
  if (!runs->empty()) {
    CellRun& last = runs->back();
    if (last.row == row_ && last.col_end == begin && SameCode(last_code_, code)) {
      last.col_end = end;
      return;
    }
  }
  last_code_ = code;
  // Set in place: copying an optional right after setting it stalls the processor.
  CellRun& run = runs->emplace_back();
  run.row = row_;
  run.col_begin = begin;
  run.col_end = end;
  if (!IsUnknown(code)) run.value = layer_->domain().Decode(code);
}

void GridCursor::PrefetchTo(int32_t row_end) {
  for (row_end = std::min(row_end, box_.row_end); prefetched_ < row_end; ++prefetched_) {
    reader_.Prefetch(prefetched_, {box_.col_begin, box_.col_end});
  }
}

}  // namespace hypermap
