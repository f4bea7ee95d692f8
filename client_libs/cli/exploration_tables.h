// Explorations as tables for people.
#ifndef HYPERMAP_CLIENT_LIBS_CLI_EXPLORATION_TABLES_H_
#define HYPERMAP_CLIENT_LIBS_CLI_EXPLORATION_TABLES_H_

#include <ostream>
#include <string>
#include <vector>

#include "client_libs/cli/output.h"

namespace hypermap::cli {

// The exploration in one line: "exploration 3 of floor into seen: active, 87.1 % seen, 0.5 m²/s".
std::string DescribeExploration(const ExplorationReport& report);

// Prints progress, goals and unreachable places. Empty tables are left out.
void PrintExploration(const ExplorationReport& report, std::ostream& out);
// Prints one row for each exploration.
void PrintExplorations(const std::vector<client::ExplorationEntry>& explorations,
                       std::ostream& out);
// Prints one row for each frontier, then the cells if they were requested.
void PrintFrontiers(const std::vector<client::FrontierEntry>& frontiers, std::ostream& out);

}  // namespace hypermap::cli

#endif  // HYPERMAP_CLIENT_LIBS_CLI_EXPLORATION_TABLES_H_
