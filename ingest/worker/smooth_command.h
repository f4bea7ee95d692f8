// The command `hypermap-ingest smooth`.
#ifndef HYPERMAP_INGEST_WORKER_SMOOTH_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_SMOOTH_COMMAND_H_

#include <CLI/CLI.hpp>

#include "ingest/worker/command.h"

namespace hypermap::ingest {

// Adds the command. Parsing sets `selected`, which must outlive the parser, if it is named.
void AddSmoothCommand(CLI::App& app, Command& selected);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_SMOOTH_COMMAND_H_
