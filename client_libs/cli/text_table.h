// Rows of text in aligned columns.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TEXT_TABLE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TEXT_TABLE_H_

#include <ostream>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace hypermap::cli {

// Columns are as wide as their widest cell, in characters of UTF-8. Columns that hold nothing but
// numbers are aligned to the right. One thread.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header);

  // A cell for each column; missing ones are empty. Control characters become blanks, so that a row
  // stays a line.
  void AddRow(std::vector<std::string> cells);
  bool empty() const { return rows_.size() == 1; }

  // The header and the rows, a line each, without blanks at the ends of lines.
  void Print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;  // the header first
};

// For people: at most `decimals` digits after the point, without trailing zeros ("2.5", "-0.04").
std::string FormatNumber(double value, int decimals = 3);

// Characters of UTF-8 text.
int DisplayWidth(absl::string_view text);

// The text on one line: control characters become blanks.
std::string OneLine(absl::string_view text);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TEXT_TABLE_H_
