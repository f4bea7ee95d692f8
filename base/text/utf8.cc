#include "base/text/utf8.h"

#include <utf8cpp/utf8.h>

#include <iterator>

namespace hypermap {

bool IsUtf8(absl::string_view text) { return utf8::is_valid(text.begin(), text.end()); }

std::string ReplaceInvalidUtf8(absl::string_view text) {
  std::string replaced;
  utf8::replace_invalid(text.begin(), text.end(), std::back_inserter(replaced));
  return replaced;
}

}  // namespace hypermap
