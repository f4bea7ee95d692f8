// Reading of whole files, and of the lines of numbers that TUM's RGB-D tools write.
#ifndef HYPERMAP_INGEST_SOURCES_INPUT_FILE_H_
#define HYPERMAP_INGEST_SOURCES_INPUT_FILE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace hypermap::ingest {

// Returns the content of a file. Errors (NOT_FOUND and others, by errno) name the file.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// The words of a line that is not empty. Blanks, tabs and commas separate words, and # begins a
// comment.
struct InputLine {
  int number = 0;  // Counted from 1.
  std::vector<std::string> words;
};
std::vector<InputLine> SplitLines(absl::string_view text);

// Parses decimal seconds since 1970, exactly to the nanosecond (a double would round present times
// to a quarter of a microsecond). Returns false for any other text.
bool ParseStamp(absl::string_view text, absl::Time& stamp);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_INPUT_FILE_H_
