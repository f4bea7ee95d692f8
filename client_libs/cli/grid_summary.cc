#include "client_libs/cli/grid_summary.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "client_libs/cli/text_table.h"

namespace hypermap::cli {

GridSummary::GridSummary(const client::LayerPart& first)
    : layer_(first.layer), values_(first.kind), geometry_(*first.grid) {}

void GridSummary::Add(const CellRun& run) {
  const int64_t count = int64_t{run.col_end} - run.col_begin;
  box_ = box_.Union({run.row, run.row + 1, run.col_begin, run.col_end});
  if (!run.value.has_value()) {
    unknown_ += count;
    return;
  }
  min_ = known_ == 0 ? *run.value : std::min(min_, *run.value);
  max_ = known_ == 0 ? *run.value : std::max(max_, *run.value);
  sum_ += static_cast<double>(count) * *run.value;
  known_ += count;
}

std::string GridSummary::DescribeValues() const {
  std::string text;
  if (known_ > 0) {
    const double mean = sum_ / static_cast<double>(known_);
    if (min_ == max_) {
      text = values_.Describe(min_);
    } else if (values_.properties().is_binary) {
      const double share = (mean - min_) / (max_ - min_);
      text = absl::StrCat(FormatNumber(100.0 * share, 1), " % ", values_.Describe(max_));
    } else {
      text = absl::StrCat(FormatNumber(min_), " to ", FormatNumber(max_), ", mean ",
                          FormatNumber(mean));
    }
  }
  if (unknown_ > 0) {
    absl::StrAppend(&text, text.empty() ? "" : "; ", FormatNumber(AreaOf(unknown_), 2),
                    " m² unknown");
  }
  return text;
}

std::string GridSummary::DescribeExtent() const {
  if (box_.empty()) return "";
  const Box bounds = geometry_.BoundsOf(box_);
  return absl::StrCat("(", FormatNumber(bounds.min.x, 2), ", ", FormatNumber(bounds.min.y, 2),
                      ") to (", FormatNumber(bounds.max.x, 2), ", ", FormatNumber(bounds.max.y, 2),
                      ")");
}

double GridSummary::AreaOf(int64_t cells) const {
  return static_cast<double>(cells) * geometry_.resolution_m * geometry_.resolution_m;
}

}  // namespace hypermap::cli
