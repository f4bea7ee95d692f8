// The log of a server: lines with named fields, on stderr.
#ifndef HYPERMAP_BASE_LOGGING_LOG_H_
#define HYPERMAP_BASE_LOGGING_LOG_H_

#include <optional>
#include <string>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace hypermap::logging {

enum class Level { kTrace, kDebug, kInfo, kWarning, kError, kOff };

// kText: "TIME level=LEVEL MESSAGE NAME=VALUE NAME=VALUE". kJson: an object on each line, with the
// fields after "time" (RFC 3339, UTC), "level" and "message", and before "file" and "line".
enum class Format { kText, kJson };

// The level called "trace", "debug", "info", "warn", "error" or "off".
std::optional<Level> ParseLevel(absl::string_view name);
// The format called "text" or "json".
std::optional<Format> ParseFormat(absl::string_view name);

// A name and a value. The name must outlive the field. The value may come from outside: it is
// escaped so that it can't be mistaken for other parts of the log, and cut if it is long.
class Field {
 public:
  Field(absl::string_view name, absl::string_view value) : name_(name), value_(value) {}
  // REQUIRES: the number is finite.
  template <typename Number, std::enable_if_t<std::is_arithmetic_v<Number>, int> = 0>
  Field(absl::string_view name, Number value)
      : name_(name), value_(absl::StrCat(value)), is_number_(true) {}

  // Appends the field as it is written in the format.
  void AppendTo(std::string* line, Format format) const;

 private:
  absl::string_view name_;
  std::string value_;
  bool is_number_ = false;
};

// Makes the log have lines of at least this level, in this format. To be called once, before other
// threads log. Until then it has lines of at least kInfo as text, on stdout.
void Start(Level least, Format format);

// Returns whether lines of this level are written; for lines that are costly to make.
bool IsLogged(Level level);

// Writes a line. The message is the program's own text, and the same in all lines of a kind.
//
//   Log(Level::kWarning, "map can't be opened", {{"map", name}, {"problem", status.ToString()}});
void Log(Level level, absl::string_view message, absl::Span<const Field> fields = {},
         const char* file = __builtin_FILE(), int line = __builtin_LINE());

// The line that Log writes, without its time and level; in JSON, without the object's braces.
std::string FormatLine(Format format, absl::string_view message, absl::Span<const Field> fields,
                       absl::string_view file, int line);

}  // namespace hypermap::logging

#endif  // HYPERMAP_BASE_LOGGING_LOG_H_
