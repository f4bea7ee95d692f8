// A picture of a map over the truth.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_EVAL_IMAGE_H_
#define HYPERMAP_CLIENT_LIBS_CLI_EVAL_IMAGE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "map/evaluation/evaluate.h"

namespace hypermap::cli {

// A PNG: map objects filled in the colour of their class, those without a pair crossed out in red;
// truth as outlines, broken and blue where nothing was found; a scale and a legend. North (y) is
// up.
absl::StatusOr<std::string> DrawEvaluation(const std::vector<evaluation::Object>& truth,
                                           const std::vector<evaluation::Object>& map,
                                           const evaluation::Evaluation& evaluation);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_EVAL_IMAGE_H_
