#include "client_libs/cli/text_table.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"

namespace hypermap::cli {
namespace {

constexpr int kGap = 2;

bool IsNumber(const std::string& cell) {
  double ignored;
  return absl::SimpleAtod(cell, &ignored);
}

}  // namespace

TextTable::TextTable(std::vector<std::string> header) { rows_.push_back(std::move(header)); }

void TextTable::AddRow(std::vector<std::string> cells) {
  cells.resize(rows_.front().size());
  for (std::string& cell : cells) cell = OneLine(cell);
  rows_.push_back(std::move(cells));
}

void TextTable::Print(std::ostream& out) const {
  const size_t num_columns = rows_.front().size();
  std::vector<int> widths(num_columns, 0);
  std::vector<bool> numeric(num_columns, !empty());
  for (size_t r = 0; r < rows_.size(); ++r) {
    for (size_t c = 0; c < num_columns; ++c) {
      widths[c] = std::max(widths[c], DisplayWidth(rows_[r][c]));
      if (r > 0 && !rows_[r][c].empty() && !IsNumber(rows_[r][c])) numeric[c] = false;
    }
  }
  for (const auto& row : rows_) {
    std::string line;
    for (size_t c = 0; c < num_columns; ++c) {
      const std::string padding(widths[c] - DisplayWidth(row[c]), ' ');
      line += numeric[c] ? padding + row[c] : row[c] + padding;
      line.append(kGap, ' ');
    }
    out << absl::StripTrailingAsciiWhitespace(line) << '\n';
  }
}

std::string FormatNumber(double value, int decimals) {
  if (!std::isfinite(value)) return absl::StrFormat("%g", value);
  std::string text = absl::StrFormat("%.*f", decimals, value);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

int DisplayWidth(absl::string_view text) {
  return static_cast<int>(
      std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xC0) != 0x80; }));
}

std::string OneLine(absl::string_view text) {
  std::string line(text);
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return absl::ascii_iscntrl(c); }, ' ');
  return line;
}

}  // namespace hypermap::cli
