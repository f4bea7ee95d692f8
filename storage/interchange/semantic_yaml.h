// The original's semantic member: a YAML list of named polygons.
#ifndef HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_YAML_H_
#define HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_YAML_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace hypermap::storage {

// An entry as the file has it; a key that is absent or null (~) is nullopt.
struct SemanticEntry {
  std::optional<std::string> name;
  std::optional<std::string> shape;  // WKT
  std::optional<std::vector<std::string>> tags;
  std::optional<std::vector<double>> confidence;  // finite
};

// Calls `take` with one entry after another, without holding the document; unknown keys are
// skipped. Ends with the first error of `take`. INVALID_ARGUMENT naming the object (counted from 1)
// or the line; aliases are refused, as a small file could make a large map of them.
absl::Status ReadSemanticYaml(absl::string_view text,
                              absl::FunctionRef<absl::Status(const SemanticEntry&)> take);

// Appends one entry of the list.
void AppendSemanticEntry(const SemanticEntry& entry, std::string& text);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_YAML_H_
