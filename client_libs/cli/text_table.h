// Prints rows of text in aligned columns.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TEXT_TABLE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TEXT_TABLE_H_

#include <ostream>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace hypermap::cli {

// A column is as wide as its widest cell, in UTF-8 characters. Columns that contain only numbers
// are right-aligned. Used by one thread.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header);

  // Adds a cell for each column; missing cells are empty. Control characters are replaced by
  // blanks, so that a row stays on one line.
  void AddRow(std::vector<std::string> cells);
  bool empty() const { return rows_.size() == 1; }

  // Prints the header and the rows, one line each, without trailing blanks.
  void Print(std::ostream& out) const;

 private:
  std::vector<std::vector<std::string>> rows_;  // the header first
};

// Returns the number with at most `decimals` decimals, without trailing zeros ("2.5", "-0.04").
std::string FormatNumber(double value, int decimals = 3);

// Number of characters of a UTF-8 text.
int DisplayWidth(absl::string_view text);

// Replaces control characters by blanks.
std::string OneLine(absl::string_view text);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TEXT_TABLE_H_
