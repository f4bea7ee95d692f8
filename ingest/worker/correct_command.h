// The command `hypermap-ingest correct`.
#ifndef HYPERMAP_INGEST_WORKER_CORRECT_COMMAND_H_
#define HYPERMAP_INGEST_WORKER_CORRECT_COMMAND_H_

#include <CLI/CLI.hpp>

#include "ingest/worker/command.h"

namespace hypermap::ingest {

// Adds the command. Parsing sets `selected`, which must outlive the parser, if it is named.
void AddCorrectCommand(CLI::App& app, Command& selected);

}  // namespace hypermap::ingest

#endif  // HYPERMAP_INGEST_WORKER_CORRECT_COMMAND_H_
