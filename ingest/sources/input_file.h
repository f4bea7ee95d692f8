// Whole files, and lines of numbers as TUM's RGB-D tools write them.
#ifndef HYPERMAP_INGEST_SOURCES_INPUT_FILE_H_
#define HYPERMAP_INGEST_SOURCES_INPUT_FILE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

namespace hypermap::ingest {

// NOT_FOUND and the like, naming the file.
absl::StatusOr<std::string> ReadFile(const std::string& path);

// A line's words; comments (from # to the end) and empty lines are left out.
struct InputLine {
  int number = 0;  // from 1
  std::vector<std::string> words;
};
std::vector<InputLine> SplitLines(absl::string_view text);

// Decimal seconds since 1970, exact to the nanosecond; false for anything else.
bool ParseStamp(absl::string_view text, absl::Time& stamp);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_SOURCES_INPUT_FILE_H_
