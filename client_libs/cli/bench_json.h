// Converts the result of a load to JSON.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_BENCH_JSON_H_
#define HYPERMAP_CLIENT_LIBS_CLI_BENCH_JSON_H_

#include "client_libs/bench/report.h"
#include "client_libs/cli/json_values.h"

namespace hypermap::cli {

Json ReportJson(const bench::FleetReport& report);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_BENCH_JSON_H_
