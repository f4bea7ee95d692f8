#include "base/logging/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"

namespace hypermap::logging {
namespace {

constexpr size_t kMaxBytes = 1000;
constexpr char kTextPattern[] = "%Y-%m-%dT%H:%M:%S.%e%z level=%l %v";
constexpr char kJsonPattern[] = R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})";

std::atomic<Format> format_of_log = Format::kText;

spdlog::level::level_enum LevelOfSpdlog(Level level) {
  switch (level) {
    case Level::kTrace:
      return spdlog::level::trace;
    case Level::kDebug:
      return spdlog::level::debug;
    case Level::kInfo:
      return spdlog::level::info;
    case Level::kWarning:
      return spdlog::level::warn;
    case Level::kError:
      return spdlog::level::err;
    case Level::kOff:
      return spdlog::level::off;
  }
  return spdlog::level::off;
}

std::string Cut(absl::string_view value) {
  if (value.size() <= kMaxBytes) return std::string(value);
  return absl::StrCat(value.substr(0, kMaxBytes), "...");
}

// Returns whether a value can stand in a line of text as it is.
bool IsWord(absl::string_view value) {
  constexpr absl::string_view kSigns = "_-.:/+";
  return !value.empty() && std::all_of(value.begin(), value.end(), [&](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || absl::StrContains(kSigns, c);
  });
}

std::string Quoted(absl::string_view value) {
  return absl::StrCat("\"", absl::CHexEscape(value), "\"");
}

// A string of JSON; bytes that are not UTF-8 become U+FFFD.
std::string JsonString(absl::string_view value) {
  return nlohmann::json(std::string(value))
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

absl::string_view WithoutFolders(absl::string_view file) {
  return file.substr(file.rfind('/') + 1);
}

}  // namespace

std::optional<Level> ParseLevel(absl::string_view name) {
  constexpr std::pair<absl::string_view, Level> kLevels[] = {
      {"trace", Level::kTrace},  {"debug", Level::kDebug}, {"info", Level::kInfo},
      {"warn", Level::kWarning}, {"error", Level::kError}, {"off", Level::kOff}};
  for (const auto& [known, level] : kLevels) {
    if (name == known) return level;
  }
  return std::nullopt;
}

std::optional<Format> ParseFormat(absl::string_view name) {
  if (name == "text") return Format::kText;
  if (name == "json") return Format::kJson;
  return std::nullopt;
}

void Field::AppendTo(std::string* line, Format format) const {
  if (format == Format::kJson) {
    absl::StrAppend(line, ",\"", name_, "\":", is_number_ ? value_ : JsonString(Cut(value_)));
  } else {
    absl::StrAppend(line, " ", name_, "=", IsWord(value_) ? Cut(value_) : Quoted(Cut(value_)));
  }
}

void Start(Level least, Format format) {
  auto logger =
      std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  if (format == Format::kJson) {
    logger->set_pattern(kJsonPattern, spdlog::pattern_time_type::utc);
  } else {
    logger->set_pattern(kTextPattern);
  }
  logger->set_level(LevelOfSpdlog(least));
  logger->flush_on(spdlog::level::info);
  format_of_log = format;
  spdlog::set_default_logger(std::move(logger));
}

bool IsLogged(Level level) { return spdlog::should_log(LevelOfSpdlog(level)); }

void Log(Level level, absl::string_view message, absl::Span<const Field> fields, const char* file,
         int line) {
  if (!IsLogged(level)) return;
  const std::string text = FormatLine(format_of_log, message, fields, file, line);
  spdlog::default_logger_raw()->log(LevelOfSpdlog(level),
                                    spdlog::string_view_t(text.data(), text.size()));
}

std::string FormatLine(Format format, absl::string_view message, absl::Span<const Field> fields,
                       absl::string_view file, int line) {
  std::string text = format == Format::kJson ? absl::StrCat("\"message\":", JsonString(message))
                                             : std::string(message);
  for (const Field& field : fields) field.AppendTo(&text, format);
  if (format == Format::kJson) {
    Field("file", WithoutFolders(file)).AppendTo(&text, format);
    Field("line", line).AppendTo(&text, format);
  }
  return text;
}

}  // namespace hypermap::logging
