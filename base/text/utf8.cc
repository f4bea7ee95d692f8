#include "base/text/utf8.h"

#include <utf8cpp/utf8.h>

#include <cstdint>
#include <iterator>

namespace hypermap {

bool IsUtf8(absl::string_view text) { return utf8::is_valid(text.begin(), text.end()); }

bool HasNoncharacter(absl::string_view text) {
  for (auto it = text.begin(); it != text.end();) {
    const uint32_t code_point = utf8::unchecked::next(it);
    if ((code_point & 0xFFFE) == 0xFFFE || (code_point >= 0xFDD0 && code_point <= 0xFDEF)) {
      return true;
    }
  }
  return false;
}

std::string ReplaceInvalidUtf8(absl::string_view text) {
  std::string replaced;
  utf8::replace_invalid(text.begin(), text.end(), std::back_inserter(replaced));
  return replaced;
}

}  // namespace hypermap
