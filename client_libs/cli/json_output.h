// Prints answers as JSON: one document, or for streams one document per line. Numbers are printed
// so that they read back as the same double; numbers that are not finite are null.
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
