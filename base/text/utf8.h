// Text as UTF-8, which Protobuf requires of every string of a message.
#ifndef HYPERMAP_BASE_TEXT_UTF8_H_
#define HYPERMAP_BASE_TEXT_UTF8_H_

#include <string>

#include "absl/strings/string_view.h"

namespace hypermap {

bool IsUtf8(absl::string_view text);

// Returns whether the text has a noncharacter, such as U+FFFF, which is no character of any script
// and which some formats replace. REQUIRES: IsUtf8(text).
bool HasNoncharacter(absl::string_view text);

// Returns `text` with U+FFFD in place of each byte sequence that is not UTF-8.
std::string ReplaceInvalidUtf8(absl::string_view text);

}  // namespace hypermap

#endif  // HYPERMAP_BASE_TEXT_UTF8_H_
