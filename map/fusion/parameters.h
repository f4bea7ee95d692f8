// Sets parameters of strategies by name from JSON numbers.
#ifndef HYPERMAP_MAP_FUSION_PARAMETERS_H_
#define HYPERMAP_MAP_FUSION_PARAMETERS_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::fusion {

// A parameter by name, and the closed range of its values.
struct Parameter {
  absl::string_view name;
  double* value;
  double low;
  double high;
};

// Sets the parameters that `json`, an object of numbers, names; empty text sets none. Names in
// `retired` are accepted and ignored, with any value.
// INVALID_ARGUMENT names the parameter that is unknown, not a number or out of range; parameters
// before it may have been set.
absl::Status SetParameters(absl::string_view json, const std::vector<Parameter>& parameters,
                           const std::vector<absl::string_view>& retired = {});

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_PARAMETERS_H_
