// Answers as JSON: one document, or for streams one a line. Numbers are written so that they read
// back as the same double; what is not finite is null.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_JSON_OUTPUT_H_
#define HYPERMAP_CLIENT_LIBS_CLI_JSON_OUTPUT_H_

#include <memory>
#include <ostream>

#include "client_libs/cli/output.h"

namespace hypermap::cli {

// `out` must outlive the output.
std::unique_ptr<Output> MakeJsonOutput(std::ostream& out);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_JSON_OUTPUT_H_
