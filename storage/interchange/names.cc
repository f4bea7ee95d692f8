#include "storage/interchange/names.h"

#include <cstdint>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "map/layers/layer_spec.h"

namespace hypermap::storage {
namespace {

constexpr absl::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD

// The number of bytes of the UTF-8 character that `text` begins with (Unicode 15, table 3-7); 0
// when it begins with none.
size_t CharacterLength(absl::string_view text) {
  const auto byte = [&](size_t i) {
    return i < text.size() ? static_cast<uint8_t>(text[i]) : uint8_t{0};
  };
  const auto continues = [&](size_t from, size_t to) {
    for (size_t i = from; i < to; ++i) {
      if ((byte(i) & 0xC0) != 0x80) return false;
    }
    return true;
  };
  const uint8_t lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return continues(1, 2) ? 2 : 0;
  if (lead >= 0xE0 && lead <= 0xEF) {
    const bool overlong = lead == 0xE0 && byte(1) < 0xA0;
    const bool surrogate = lead == 0xED && byte(1) > 0x9F;
    return !overlong && !surrogate && continues(1, 3) ? 3 : 0;
  }
  if (lead >= 0xF0 && lead <= 0xF4) {
    const bool overlong = lead == 0xF0 && byte(1) < 0x90;
    const bool too_high = lead == 0xF4 && byte(1) > 0x8F;
    return !overlong && !too_high && continues(1, 4) ? 4 : 0;
  }
  return 0;
}

std::string SanitizeIdentifier(absl::string_view text, absl::string_view also_allowed) {
  while (!text.empty() && !absl::ascii_isalnum(text.front())) text.remove_prefix(1);
  std::string name(text.substr(0, kMaxNameLength));
  for (char& c : name) {
    if (!absl::ascii_isalnum(c) && also_allowed.find(c) == absl::string_view::npos) c = '_';
  }
  return name;
}

}  // namespace

std::string CleanWord(absl::string_view text) {
  std::string word;
  bool blank_pending = false;
  while (!text.empty()) {
    const size_t length = CharacterLength(text);
    if (length == 1 && (absl::ascii_isspace(text[0]) || absl::ascii_iscntrl(text[0]))) {
      blank_pending = !word.empty();
    } else {
      if (blank_pending) word.push_back(' ');
      blank_pending = false;
      word += std::string(length == 0 ? kReplacement : text.substr(0, length));
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return word;
}

std::string CutText(absl::string_view text, size_t max_bytes) {
  constexpr absl::string_view kDots = "...";
  if (text.size() <= max_bytes) return std::string(text);
  size_t end = max_bytes - kDots.size();
  // At most three bytes continue a character.
  for (int i = 0; i < 3 && end > 0 && (text[end] & 0xC0) == 0x80; ++i) --end;
  return absl::StrCat(text.substr(0, end), kDots);
}

std::string SanitizeName(absl::string_view text) {
  std::string name = SanitizeIdentifier(text, "_-.");
  return name.empty() ? "layer" : name;
}

std::string SanitizeFrameId(absl::string_view text) { return SanitizeIdentifier(text, "_-./"); }

}  // namespace hypermap::storage
