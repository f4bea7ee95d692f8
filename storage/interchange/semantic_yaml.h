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

// Calls `take` with one entry after another; the document is never in memory as a whole. Unknown
// keys are skipped. Stops at the first error of `take` and returns it. INVALID_ARGUMENT naming the
// object (counted from 1) or the line. YAML aliases are refused, because a small file with them
// could become a huge map, and so is text in UTF-16 or UTF-32. Takes memory for the entry that is
// being read and for all that the parser has read ahead; RESOURCE_EXHAUSTED when it is refused.
absl::Status ReadSemanticYaml(absl::string_view text,
                              absl::FunctionRef<absl::Status(const SemanticEntry&)> take);

// Appends one entry of the list to `text`.
void AppendSemanticEntry(const SemanticEntry& entry, std::string& text);

}  // namespace hypermap::storage

#endif  // HYPERMAP_STORAGE_INTERCHANGE_SEMANTIC_YAML_H_
