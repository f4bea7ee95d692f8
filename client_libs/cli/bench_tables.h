// The result of a load as tables for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_BENCH_TABLES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_BENCH_TABLES_H_

#include <ostream>

#include "client_libs/bench/report.h"

namespace hypermap::cli {

// Prints one row for each kind of operation, then the outages, the processes, and whether
// everything holds.
void PrintReport(const bench::FleetReport& report, std::ostream& out);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_BENCH_TABLES_H_
