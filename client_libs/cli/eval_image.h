// A picture of a map over the ground truth.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_EVAL_IMAGE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_EVAL_IMAGE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/evaluation/evaluate.h"

namespace hypermap::cli {

// Returns a PNG. Objects of the map are filled in the colour of their class, and crossed out in red
// if they match no true object. True objects are outlines, broken and blue if they were not found.
// There is a scale and a legend. North (y) is up.
absl::StatusOr<std::string> DrawEvaluation(const std::vector<evaluation::Object>& truth,
                                           const std::vector<evaluation::Object>& map,
                                           const evaluation::Evaluation& evaluation);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_EVAL_IMAGE_H_
