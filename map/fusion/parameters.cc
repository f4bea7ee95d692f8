#include "map/fusion/parameters.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace hypermap::fusion {

absl::Status SetParameters(absl::string_view json, const std::vector<Parameter>& parameters,
                           const std::vector<absl::string_view>& retired) {
  if (json.empty()) return absl::OkStatus();
  const auto object = nlohmann::json::parse(json.begin(), json.end(), nullptr, false);
  if (!object.is_object()) {
    return absl::InvalidArgumentError("parameters: not a JSON object");
  }
  for (const auto& [name, value] : object.items()) {
    if (std::find(retired.begin(), retired.end(), name) != retired.end()) continue;
    const auto found = std::find_if(parameters.begin(), parameters.end(),
                                    [&name = name](const Parameter& p) { return p.name == name; });
    if (found == parameters.end()) {
      const auto names = absl::StrJoin(parameters, ", ", [](std::string* out, const Parameter& p) {
        absl::StrAppend(out, p.name);
      });
      return absl::InvalidArgumentError(
          absl::StrCat("parameters: there is no '", name, "'; there are ", names));
    }
    if (!value.is_number()) {
      return absl::InvalidArgumentError(absl::StrCat("parameters.", name, ": not a number"));
    }
    const double number = value.get<double>();
    if (!(number >= found->low && number <= found->high)) {
      return absl::InvalidArgumentError(
          absl::StrCat("parameters.", name, ": must be in [", found->low, ", ", found->high, "]"));
    }
    *found->value = number;
  }
  return absl::OkStatus();
}

}  // namespace hypermap::fusion
