#include "ingest/sources/input_file.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace hypermap::ingest {

absl::StatusOr<std::string> ReadFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    return absl::InvalidArgumentError(absl::StrCat(path, " is a folder"));
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::ErrnoToStatus(errno != 0 ? errno : EIO, path);
  std::string data((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) return absl::DataLossError(absl::StrCat("can't read ", path));
  return data;
}

std::vector<InputLine> SplitLines(absl::string_view text) {
  std::vector<InputLine> lines;
  int number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = line.substr(0, line.find('#'));
    std::vector<std::string> words =
        absl::StrSplit(line, absl::ByAnyChar(" \t\r,"), absl::SkipEmpty());
    if (!words.empty()) lines.push_back({number, std::move(words)});
  }
  return lines;
}

bool ParseStamp(absl::string_view text, absl::Time& stamp) {
  const std::pair<absl::string_view, absl::string_view> parts =
      absl::StrSplit(text, absl::MaxSplits('.', 1));
  int64_t seconds = 0;
  // The year is below 10,000, so that absl::Time and every database can format it.
  constexpr int64_t kMaxSeconds = 250'000'000'000;
  if (!absl::SimpleAtoi(parts.first, &seconds) || seconds < 0 || seconds > kMaxSeconds) {
    return false;
  }
  std::string fraction(parts.second.substr(0, 9));
  fraction.resize(9, '0');
  for (const char c : parts.second) {
    if (!absl::ascii_isdigit(c)) return false;
  }
  int64_t nanoseconds = 0;
  if (!absl::SimpleAtoi(fraction, &nanoseconds)) return false;
  stamp = absl::FromUnixSeconds(seconds) + absl::Nanoseconds(nanoseconds);
  return true;
}

}  // namespace hypermap::ingest
