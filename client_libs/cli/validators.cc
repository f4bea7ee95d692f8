#include "client_libs/cli/validators.h"

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client_libs/cli/as_of.h"
#include "client_libs/cli/coordinates.h"
#include "map/geometry/shape.h"
#include "map/layers/layer_spec.h"

namespace hypermap::cli {
namespace {

// The message for CLI11, which is empty if the value is valid.
template <typename T>
std::string Problem(const absl::StatusOr<T>& parsed) {
  return parsed.ok() ? "" : std::string(parsed.status().message());
}

}  // namespace

CLI::Validator IsNumber() {
  return CLI::Validator([](std::string& text) { return Problem(ParseNumber(text)); }, "");
}

CLI::Validator IsPoint() {
  return CLI::Validator([](std::string& text) { return Problem(ParsePoint(text)); }, "");
}

CLI::Validator IsPose() {
  return CLI::Validator([](std::string& text) { return Problem(ParsePose(text)); }, "");
}

CLI::Validator IsLayerKind() {
  return CLI::Validator(
      [](std::string& text) {
        return ParseLayerKind(text).has_value()
                   ? ""
                   : absl::StrCat("\"", text, "\" is not a kind of layer");
      },
      "");
}

CLI::Validator IsCellRule() {
  return CLI::Validator(
      [](std::string& text) {
        return ParseCellRule(text).has_value()
                   ? ""
                   : absl::StrCat("\"", text, "\" is not centre, covered or touched");
      },
      "");
}

CLI::Validator IsShapeKind() {
  return CLI::Validator(
      [](std::string& text) {
        return ParseShapeKind(text).has_value()
                   ? ""
                   : absl::StrCat("\"", text, "\" is not polygon, line_string or point");
      },
      "");
}

CLI::Validator IsAlias() {
  return CLI::Validator(
      [](std::string& text) {
        return text.find('=') != std::string::npos && text.front() != '='
                   ? ""
                   : absl::StrCat("\"", text, "\" is not ALIAS=LABEL,...");
      },
      "");
}

CLI::Validator IsTimeout() {
  return CLI::Validator(
      [](std::string& text) {
        absl::Duration timeout;
        return absl::ParseDuration(text, &timeout) && timeout >= absl::ZeroDuration()
                   ? ""
                   : absl::StrCat("\"", text, "\" is not a duration such as 1.5s or 2m");
      },
      "");
}

CLI::Validator IsAsOf() {
  return CLI::Validator([](std::string& text) { return Problem(ParseAsOf(text)); }, "");
}

}  // namespace hypermap::cli
