// Prints answers as tables for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TABLE_OUTPUT_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TABLE_OUTPUT_H_

#include <memory>
#include <ostream>

#include "client_libs/cli/output.h"

namespace hypermap::cli {

// `out` must outlive the output.
std::unique_ptr<Output> MakeTableOutput(std::ostream& out);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TABLE_OUTPUT_H_
