// Converts numbers to text and back.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_NUMBER_TEXT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_NUMBER_TEXT_H_

#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::storage {

// The shortest decimal that reads back as exactly this number.
std::string FormatNumber(double value);

// Parses a finite decimal number with optional blanks around it; nullopt for any other text, also
// "nan", "inf" and hexadecimal numbers.
std::optional<double> ParseNumber(absl::string_view text);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_NUMBER_TEXT_H_
