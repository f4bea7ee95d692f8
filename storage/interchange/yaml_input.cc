#include "storage/interchange/yaml_input.h"

#include <algorithm>

#include "base/cancellation/cancellation.h"
#include "base/status/status_macros.h"

namespace hypermap::storage {
namespace {

// Bytes that yaml-cpp reads at a time.
constexpr size_t kPieceBytes = 2048;

// Bytes of memory that yaml-cpp 0.7 takes for a character, from measurements. A token in its queue
// takes 91.
//
// A separator comes with up to four tokens: in "{a," these are the key, its text, the value that is
// missing, and the comma.
constexpr absl::string_view kSeparators = ",[]{}:?\n\r";
constexpr int64_t kBytesOfSeparator = 400;
// Each of these begins at most one token or, after "%", one parameter.
constexpr absl::string_view kMarks = " \t\"'&*!|>";
constexpr int64_t kBytesOfMark = 100;
// The text of a scalar is copied a few times.
constexpr int64_t kBytesOfText = 4;
// An indentation, and the name of an anchor or tag, which are kept until the document ends.
constexpr int64_t kBytesOfIndentation = 40;
constexpr int64_t kBytesOfName = 150;

// A line that is indented deeper counts as one that is indented this far.
constexpr size_t kMaxIndentation = 1024;

bool IsBlankAfter(absl::string_view text, size_t index, char before) {
  return index > 0 && text[index - 1] == before &&
         absl::string_view(" \t\n\r").find(text[index]) != absl::string_view::npos;
}

// Bytes of memory for a character until its tokens have left the queue.
int64_t BytesToQueue(absl::string_view text, size_t index) {
  const char c = text[index];
  if (kSeparators.find(c) != absl::string_view::npos || IsBlankAfter(text, index, '-')) {
    return kBytesOfText + kBytesOfSeparator;
  }
  if (kMarks.find(c) != absl::string_view::npos) return kBytesOfText + kBytesOfMark;
  return kBytesOfText;
}

}  // namespace

YamlInput::~YamlInput() {
  if (meter_ != nullptr) meter_->GiveBack(taken_bytes_);
}

void YamlInput::Release(int64_t position) {
  if (meter_ == nullptr) return;
  int64_t bytes = 0;
  while (released_ < read_ && static_cast<int64_t>(released_) < position) {
    bytes += BytesToQueue(text_, released_++);
  }
  meter_->GiveBack(bytes);
  taken_bytes_ -= bytes;
}

YamlInput::int_type YamlInput::underflow() {
  const size_t end = std::min(read_ + kPieceBytes, text_.size());
  if (status_.ok()) status_ = CheckCancelled();
  if (status_.ok()) status_ = Take(end);
  if (!status_.ok() || read_ == end) return traits_type::eof();
  // The interface wants pointers to char, but nobody writes through them.
  char* const text = const_cast<char*>(text_.data());
  setg(text + read_, text + read_, text + end);
  read_ = end;
  return traits_type::to_int_type(*gptr());
}

absl::Status YamlInput::Take(size_t end) {
  if (meter_ == nullptr) return absl::OkStatus();
  int64_t bytes = 0;
  for (size_t i = read_; i < end; ++i) bytes += BytesToQueue(text_, i) + BytesToKeep(i);
  HYPERMAP_RETURN_IF_ERROR(meter_->Take(bytes));
  taken_bytes_ += bytes;
  return absl::OkStatus();
}

int64_t YamlInput::BytesToKeep(size_t index) {
  const char c = text_[index];
  int64_t bytes = c == '&' || c == '%' ? kBytesOfName : 0;
  // A new indentation may begin behind "- " or "? ", or in a line that is indented deeper than the
  // line before.
  if (IsBlankAfter(text_, index, '-') || IsBlankAfter(text_, index, '?')) {
    bytes += kBytesOfIndentation;
  }
  if (c == '\n') {
    const absl::string_view line = text_.substr(index + 1, kMaxIndentation);
    const size_t indentation = std::min(line.find_first_not_of(' '), line.size());
    if (indentation > indentation_) bytes += kBytesOfIndentation;
    indentation_ = indentation;
  }
  return bytes;
}

}  // namespace hypermap::storage
