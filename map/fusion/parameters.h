// Parameters of strategies, given by name as JSON numbers.
#ifndef HYPERMAP_MAP_FUSION_PARAMETERS_H_
#define HYPERMAP_MAP_FUSION_PARAMETERS_H_

#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::fusion {

// A number that can be set, and the range it must lie in (both ends counted).
struct Parameter {
  absl::string_view name;
  double* value;
  double low;
  double high;
};

// Sets those that `json`, an object of numbers, names; empty text sets none. INVALID_ARGUMENT
// naming the parameter that is unknown, no number or out of range.
absl::Status SetParameters(absl::string_view json, const std::vector<Parameter>& parameters);

}  // namespace hypermap::fusion

#endif  // HYPERMAP_MAP_FUSION_PARAMETERS_H_
