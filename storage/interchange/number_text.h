// Numbers as text files hold them.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_NUMBER_TEXT_H_
#define HYPERMAP_STORAGE_INTERCHANGE_NUMBER_TEXT_H_

#include <optional>
#include <string>

#include "absl/strings/string_view.h"

namespace hypermap::storage {

// The shortest decimal that reads back as exactly this double.
std::string FormatNumber(double value);

// The finite double that all of `text` spells, blanks around it allowed; nullopt for anything else,
// "nan" and "inf" among it.
std::optional<double> ParseNumber(absl::string_view text);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_NUMBER_TEXT_H_
