// `hypermap-ingest simulate`.
#ifndef HYPERMAP_INGEST_WORKER_SIMULATE_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_SIMULATE_COMMAND_H_

#include <CLI/CLI.hpp>

#include "ingest/worker/command.h"

namespace hypermap::ingest {

// `selected` is set when the command line names this command; it must outlive the parser.
void AddSimulateCommand(CLI::App& app, Command& selected);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_SIMULATE_COMMAND_H_
