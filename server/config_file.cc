#include "server/config_file.h"

#include <yaml-cpp/yaml.h>

#include <set>

#include "absl/flags/commandlineflag.h"
#include "absl/flags/reflection.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "base/status/status_macros.h"
#include "base/tls/tls_file.h"

namespace hypermap::server {
namespace {

constexpr char kConfig[] = "config";

absl::Status Invalid(const YAML::Node& node, absl::string_view problem) {
  return absl::InvalidArgumentError(absl::StrCat("line ", node.Mark().line + 1, ": ", problem));
}

// The flag of this name if it is hypermapd's own, and not one of a library.
const absl::CommandLineFlag* FindOwnFlag(const std::string& name) {
  const absl::CommandLineFlag* const flag = absl::FindCommandLineFlag(name);
  return flag != nullptr && absl::StrContains(flag->Filename(), "server/") ? flag : nullptr;
}

absl::StatusOr<std::vector<FlagValue>> ValuesOf(const YAML::Node& root) {
  std::vector<FlagValue> values;
  if (root.IsNull()) return values;
  if (!root.IsMap()) return Invalid(root, "not a mapping of flags to values");
  std::set<std::string> names;
  for (const auto& entry : root) {
    const std::string name = entry.first.Scalar();
    if (name == kConfig || FindOwnFlag(name) == nullptr) {
      return Invalid(entry.first, absl::StrCat("\"", name, "\" is no flag of hypermapd"));
    }
    if (!names.insert(name).second) {
      return Invalid(entry.first, absl::StrCat("\"", name, "\" occurs twice"));
    }
    if (!entry.second.IsScalar()) {
      return Invalid(entry.second, absl::StrCat("\"", name, "\" has no single value"));
    }
    values.push_back({name, entry.second.Scalar()});
  }
  return values;
}

}  // namespace

absl::StatusOr<std::vector<FlagValue>> ParseConfig(const std::string& yaml) {
  try {
    return ValuesOf(YAML::Load(yaml));
  } catch (const YAML::Exception& error) {
    return absl::InvalidArgumentError(error.what());
  }
}

absl::Status SetFlags(const std::vector<FlagValue>& values) {
  for (const FlagValue& value : values) {
    std::string error;
    if (!absl::FindCommandLineFlag(value.name)->ParseFrom(value.value, &error)) {
      return absl::InvalidArgumentError(
          absl::StrCat(value.name, ": ", absl::StripAsciiWhitespace(error)));
    }
  }
  return absl::OkStatus();
}

std::string ConfigOnCommandLine(const std::vector<absl::string_view>& args) {
  std::string path;
  for (size_t i = 0; i < args.size(); ++i) {
    absl::string_view arg = args[i];
    if (arg == "--") break;
    if (!absl::ConsumePrefix(&arg, "--") && !absl::ConsumePrefix(&arg, "-")) continue;
    if (!absl::ConsumePrefix(&arg, kConfig)) continue;
    if (absl::ConsumePrefix(&arg, "=")) {
      path = std::string(arg);
    } else if (arg.empty() && i + 1 < args.size()) {
      path = std::string(args[++i]);
    }
  }
  return path;
}

absl::Status ReadConfigFile(const std::string& path) {
  HYPERMAP_ASSIGN_OR_RETURN(const std::string yaml, tls::ReadFile(path));
  absl::Status status;
  if (const absl::StatusOr<std::vector<FlagValue>> values = ParseConfig(yaml); values.ok()) {
    status = SetFlags(*values);
  } else {
    status = values.status();
  }
  if (status.ok()) return status;
  return absl::InvalidArgumentError(absl::StrCat(path, ": ", status.message()));
}

}  // namespace hypermap::server
