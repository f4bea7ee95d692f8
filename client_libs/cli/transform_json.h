// Converts estimated transforms to JSON.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_JSON_H_
#define HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_JSON_H_

#include "client_libs/cli/json_values.h"
#include "client_libs/cli/output.h"

namespace hypermap::cli {

Json ReportJson(const TransformReport& report);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_TRANSFORM_JSON_H_
